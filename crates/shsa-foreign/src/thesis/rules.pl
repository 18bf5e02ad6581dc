
% Rules: substitution(Variable, Relations) gives every substitution once, as a sorted list of relations.
%   swipl -g "forall(substitution(speed, S), (print(S), nl))" -t halt FILE
% A substitution of a variable is a set of relations: one above the variable and above each variable that is not
% provided and that is needed, without a cycle. A provided variable is not substituted further, except the one that
% is asked for; its empty substitution is an answer too.
:- dynamic function/3, implementation/2, itomsOf/2, itomOf/2.

substitution(V, Relations) :- distinct(Relations, chosen_relations(V, Relations)).

provided(V) :- itomsOf(V, [_|_]), !.
provided(V) :- itomOf(V, _), !.

chosen_relations(V, []) :- provided(V).
chosen_relations(V, Relations) :-
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
