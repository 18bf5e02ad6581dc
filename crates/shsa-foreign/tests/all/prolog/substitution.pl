% Every substitution of every variable, from the facts of a knowledge base, by the rules that an export ends with.
%
% swipl substitution.pl -- facts.pl ..      prints lines: file, variable, relations, with tabs between them

% How many steps one variable may take, in inferences.
limit(20 000 000).

:- include('../../../src/thesis/rules.pl').

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
