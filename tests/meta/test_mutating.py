"""Machine-made mutants: what the operators change, and names that last."""

from __future__ import annotations

import pytest

from tests.meta.machine.command import chosen
from tests.meta.machine.mutating import brief, mutants_of
from tests.meta.machine.serving import PrivateModules, all_mutants


def becomes(source: str) -> set[str]:
    """What the mutants of a source make of its statements."""
    return {mutant.becomes for mutant in mutants_of(source, "m")}


# Operators.


@pytest.mark.parametrize(
    ("source", "wanted"),
    [
        ("x = a < b", {"x = a <= b", "x = a >= b"}),
        ("x = a == b", {"x = a != b"}),
        ("x = a is not None", {"x = a is None"}),
        ("x = a in b", {"x = a not in b"}),
        ("x = a + b", {"x = a - b"}),
        ("x = a ^ b", {"x = a & b", "x = a | b"}),
        ("x = -a", {"x = a"}),
        ("x += y", {"x -= y", "x = y", "pass"}),
        ("x = 5", {"x = 6", "x = 4"}),
        ("x = True", {"x = False"}),
        ("x = None", {"x = 0"}),
        ("x = b''", {"x = b'\\x00'"}),
        ("x = a.to_bytes(n, 'big')", {"x = a.to_bytes(n, 'little')"}),
        ("x = 'text'", set()),
        ("x = a and b", {"x = a or b", "x = a", "x = b"}),
        ("x = not a", {"x = a"}),
        ("x = a if b else c", {"x = a", "x = c"}),
        ("if a:\n    b()", {"if True:", "if False:", "if not a:", "pass"}),
        ("while a < b:\n    c = d", {"while False:", "while a <= b:", "while a >= b:"}),
        ("for a in b:\n    c = a", {"pass"}),
        ("x = [a for a in b if a]", {"x = [a for a in b]"}),
        ("self.a = b", {"pass"}),
        ("a = b", set()),
        ("raise ValueError('a' + 'b')", {"pass"}),
        ("x = min(a)", {"x = max(a)"}),
        ("x = (a, b)", {"x = (b, a)"}),
        ("f((a, b))", {"pass", "f((a,))", "f((b,))", "f((b, a))"}),
        ("x = {1: a}", {"x = {}", "x = {2: a}", "x = {0: a}"}),
        ("x = a[1:b]", {"x = a[:b]", "x = a[1:]", "x = a[2:b]", "x = a[0:b]"}),
        ("x = NmtState.STOPPED", {"x = NmtState.OPERATIONAL"}),
    ],
)
def test_operators_change_one_thing(source: str, wanted: set[str]) -> None:
    """Each operator makes of a statement what it should, and nothing else does anything."""
    assert becomes(source) == wanted


@pytest.mark.parametrize(
    ("annotation", "wanted"),
    [
        ("bool", {"return True", "return False"}),
        ("Frames", {"return ()", "return (*a, *a)"}),
        ("int", {"return 0"}),
        ("int | None", {"return None"}),
        ("Frame", set()),
    ],
)
def test_results_change_as_the_annotation_allows(annotation: str, wanted: set[str]) -> None:
    """A function may return another value of its type."""
    assert becomes(f"def f(a) -> {annotation}:\n    return a") == wanted


def test_what_does_not_act_is_left_alone() -> None:
    """Docstrings, annotations, decorators, imports, slots and texts of errors stay."""
    source = '''
"""Text."""
from a import b
@c(slots=True)
class D(E):
    """Text."""
    __slots__ = ("a", "b")
    f: int | None
'''
    assert becomes(source) == set()


def test_every_mutant_is_a_program() -> None:
    """Each mutant of the keypad differs from its source, and can be compiled."""
    sources = PrivateModules()
    for mutant in all_mutants()[::7]:
        tree = sources.tree(mutant.module)
        compile(mutant.applied(tree), "mutant", "exec", dont_inherit=True)
        assert mutant.was != mutant.becomes


# Names.

SOURCE = "def f(a):\n    if a < 3:\n        return a + 1\n    return a + 1\n"


def test_keys_survive_edits_elsewhere() -> None:
    """Lines, comments and functions above a mutant change its number and line, not its key."""
    above = "# a comment\nx = 3\n\n\ndef e(b):\n    return b - 1\n\n\n"
    before = {mutant.key for mutant in mutants_of(SOURCE, "m")}
    after = {mutant.key for mutant in mutants_of(above + SOURCE, "m")}
    assert before < after


def test_the_same_change_twice_is_told_apart() -> None:
    """Equal statements of one function have equal texts and count their turns."""
    turns = [each.turn for each in mutants_of(SOURCE, "m") if each.becomes == "return a - 1"]
    assert turns == [1, 2]
    assert len({mutant.key for mutant in all_mutants()}) == len(all_mutants())


def test_long_statements_are_told_around_the_change() -> None:
    """Of a long table only the neighbourhood of the changed entry is in the key."""
    was = f"x = {{{', '.join(f'name_{n}: {n}' for n in range(40))}}}"
    old, new = brief(was, was.replace("name_20: 20", "name_20: 21"))
    assert "name_20: 20" in old
    assert "name_20: 21" in new
    assert max(map(len, (old, new))) < 140
    assert "name_1:" not in old
    assert "name_39" not in old


def test_mutants_are_chosen_by_module_function_or_name() -> None:
    """A name means all that it fits; one that fits none is refused."""
    everything = all_mutants()
    assert {each.module for each in chosen(["emcy"], everything)} == {"node_model.emcy"}
    assert {each.function for each in chosen(["Operation.fire"], everything)} == {"Operation.fire"}
    assert [each.number for each in chosen(["emcy-2"], everything)] == [2]
    with pytest.raises(ValueError, match="nonesuch"):
        chosen(["nonesuch"], everything)
