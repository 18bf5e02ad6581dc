% Every substitution of every variable, from the facts of a knowledge base: the definition, by trying everything.
%
% A substitution of a variable is a set of relations: one above the variable and above each variable that is not
% provided and that is needed, without a cycle. A provided variable is not substituted further, except the one that
% is asked for; its empty substitution is an answer too.
%
% swipl substitution.pl -- facts.pl ..      prints lines: file, variable, relations, with tabs between them

:- dynamic function/3, itomsOf/2, itomOf/2.

% How many steps one variable may take, in inferences.
limit(20 000 000).

provided(V) :- itomsOf(V, [_|_]), !.
provided(V) :- itomOf(V, _), !.

substitution(V, []) :- provided(V).
substitution(V, Relations) :-
    choose([V], V, [], Choice),
    findall(R, member(chosen(_, R, _), Choice), List),
    sort(List, Relations).

% Decides about each variable of the list, and about those that its relation needs in turn.
choose([], _, Choice, Choice).
choose([V|Open], Root, Before, Choice) :-
    (   memberchk(chosen(V, _, _), Before)
    ->  choose(Open, Root, Before, Choice)
    ;   V \== Root, provided(V)
    ->  choose(Open, Root, Before, Choice)
    ;   function(V, R, Inputs),
        \+ ( member(Input, Inputs), rests_on(Input, V, Before) ),
        append(Inputs, Open, More),
        choose(More, Root, [chosen(V, R, Inputs)|Before], Choice)
    ).

rests_on(V, V, _) :- !.
rests_on(Input, V, Choice) :-
    memberchk(chosen(Input, _, Inputs), Choice),
    member(Next, Inputs),
    rests_on(Next, V, Choice), !.

variable(V) :-
    findall(O, function(O, _, _), Outputs),
    findall(I, ( function(_, _, Is), member(I, Is) ), Inputs),
    findall(P, ( itomsOf(P, _) ; itomOf(P, _) ), Provided),
    append([Outputs, Inputs, Provided], All),
    sort(All, Variables),
    member(V, Variables).

answer(File) :-
    forall(variable(V), answer(File, V)).

answer(File, V) :-
    limit(Limit),
    call_with_inference_limit(findall(S, substitution(V, S), All), Limit, Outcome),
    (   Outcome == inference_limit_exceeded
    ->  format("~w\t~w\t!limit~n", [File, V])
    ;   sort(All, Sets),
        forall(member(Set, Sets), ( atomic_list_concat([File, V|Set], '\t', Line), writeln(Line) ))
    ).

% Only facts are taken; nothing of the file is run.
facts(File) :-
    retractall(function(_, _, _)), retractall(itomsOf(_, _)), retractall(itomOf(_, _)),
    setup_call_cleanup(open(File, read, Stream), facts_of(Stream), close(Stream)).

facts_of(Stream) :-
    read_term(Stream, Term, []),
    (   Term == end_of_file
    ->  true
    ;   fact(Term),
        facts_of(Stream)
    ).

fact(function(O, R, I)) :- !, assertz(function(O, R, I)).
fact(itomsOf(V, I)) :- !, assertz(itomsOf(V, I)).
fact(itomOf(V, I)) :- !, assertz(itomOf(V, I)).
fact(_).

main :-
    current_prolog_flag(argv, Files),
    forall(member(File, Files), ( facts(File), answer(File) )).

:- initialization(main, main).
