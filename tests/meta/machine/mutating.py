"""Mutants that no human chose: every small change that the operators make to a source.

A mutant is known by the statement in which it lies, before and after, and by the function
around it: line numbers move with every edit, these do not. What does not act (annotations,
docstrings, decorators, texts of errors) is left alone.
"""

from __future__ import annotations

import ast
import copy
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeVar, cast

from tests.meta.machine.operators import Place, alternatives

Node = TypeVar("Node", bound=ast.AST)

Path = tuple[tuple[str, int | None], ...]
"""From the module down to a node: fields, with the place in the list where one is meant."""

Key = tuple[str, str, str, str, int]
"""What a mutant is known by: module, function, statement before and after, turn."""

LONG = 120
"""Of longer statements only the surroundings of the change are told."""

AROUND = 50
"""Characters that are told before and after a change, at least."""

_IDLE = frozenset(("annotation", "returns", "decorator_list", "bases", "exc", "cause"))
"""Fields below which nothing is changed: they do not act, or only tell a text."""

_IDLE_NODES = (ast.Import, ast.ImportFrom, ast.JoinedStr, ast.Global, ast.Nonlocal)

_Compound = ast.If | ast.While | ast.For | ast.With | ast.FunctionDef | ast.ClassDef


@dataclass(frozen=True, slots=True)
class Mutant:
    """A source with one change.

    Args:
        module: dotted name.
        function: qualified name of what the change lies in; "" = the module itself.
        was: the statement before, its head alone where it has a body.
        becomes: the statement after.
        turn: counts from 1 where the same change is possible more than once in a function.
        number: counts from 1 in each module; moves with edits.
        line: of the changed node.
        lines: first and last line of the statement.
        runs: whether it lies in the body of a function, so that it acts only when called.
        path: to the changed node.
        change: what takes its place.
    """

    module: str
    function: str
    was: str
    becomes: str
    turn: int
    number: int
    line: int
    lines: tuple[int, int]
    runs: bool
    path: Path
    change: ast.AST

    @property
    def key(self) -> Key:
        """What it is known by when lines move."""
        return self.module, self.function, self.was, self.becomes, self.turn

    @property
    def name(self) -> str:
        """Short, for the command line: module and number."""
        return f"{self.module.removeprefix('node_model.')}-{self.number}"

    def applied(self, tree: ast.Module) -> ast.Module:
        """The changed module; `tree` is the right one and stays."""
        return _changed(tree, self.path, self.change)


@dataclass(frozen=True, slots=True)
class _Site:
    """A node on the walk, with what lies around it."""

    node: ast.AST
    path: Path
    place: Place
    statement: ast.stmt
    statement_path: Path
    function: str
    runs: bool


def mutants_of(source: str, module: str) -> list[Mutant]:
    """All mutants of a module, in the order of its source."""
    tree = ast.parse(source)
    found: list[Mutant] = []
    turns: Counter[tuple[str, str, str]] = Counter()
    seen: set[tuple[Path, str]] = set()
    for site in _sites(tree):
        was = _head(site.statement)
        for change in alternatives(site.node, site.place):
            whole = _becomes(site, change).splitlines()[0]
            if whole == was or (site.statement_path, whole) in seen:
                continue
            seen.add((site.statement_path, whole))
            before, after = brief(was, whole)
            turns[site.function, before, after] += 1
            found.append(
                Mutant(
                    module,
                    site.function,
                    before,
                    after,
                    turns[site.function, before, after],
                    len(found) + 1,
                    getattr(site.node, "lineno", site.statement.lineno),
                    _lines(site.statement),
                    site.runs,
                    site.path,
                    change,
                )
            )
    return found


def _sites(tree: ast.Module) -> Iterator[_Site]:
    """Every node that acts, statements before what they are made of."""
    for number, statement in enumerate(tree.body):
        path: Path = (("body", number),)
        place = Place(parent=tree)
        yield from _walk(_Site(statement, path, place, statement, path, "", runs=False))


def _walk(site: _Site) -> Iterator[_Site]:
    node = site.node
    if isinstance(node, _IDLE_NODES) or _is_layout(node):
        return
    if isinstance(node, ast.stmt):
        site = _Site(node, site.path, site.place, node, site.path, site.function, site.runs)
    yield site
    for field, value in ast.iter_fields(node):
        if field in _IDLE:
            continue
        for index, child in enumerate(value) if isinstance(value, list) else ((None, value),):
            if isinstance(child, ast.AST):
                yield from _walk(_below(site, child, field, index))


def _is_layout(node: ast.AST) -> bool:
    """The order of slots is nobody's affair."""
    return isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__slots__"


def _below(site: _Site, child: ast.AST, field: str, index: int | None) -> _Site:
    """The site of a child; inside a function or class the name grows."""
    node, function, runs, returns = site.node, site.function, site.runs, site.place.returns
    if isinstance(node, ast.FunctionDef | ast.ClassDef) and field == "body":
        function = f"{function}.{node.name}" if function else node.name
        if isinstance(node, ast.FunctionDef):
            runs = True
            returns = ast.unparse(node.returns) if node.returns else ""
    return _Site(
        child,
        (*site.path, (field, index)),
        Place(node, field, returns),
        site.statement,
        site.statement_path,
        function,
        runs,
    )


def _at(tree: ast.AST, path: Path) -> ast.AST:
    """The node at the end of a path."""
    node = tree
    for field, index in path:
        value = getattr(node, field)
        node = value if index is None else value[index]
    return node


def _changed(tree: Node, path: Path, change: ast.AST) -> Node:
    """A copy of the tree with another node at the end of the path."""
    new, old = copy.deepcopy(change), _at(tree, path)
    if isinstance(old, ast.stmt | ast.expr):
        ast.copy_location(new, old)
    if not path:
        return cast("Node", ast.fix_missing_locations(new))
    copied = copy.deepcopy(tree)
    parent = _at(copied, path[:-1])
    field, index = path[-1]
    if index is None:
        setattr(parent, field, new)
    else:
        getattr(parent, field)[index] = new
    return ast.fix_missing_locations(copied)


def _becomes(site: _Site, change: ast.AST) -> str:
    """The statement with the change; its body, which may be long, is not copied."""
    path = site.path[len(site.statement_path) :]
    return ast.unparse(_changed(_without_body(site.statement), path, _without_body(change)))


def _without_body(node: Node) -> Node:
    """The same node; a statement with a body has only `...` in it."""
    if not isinstance(node, _Compound):
        return node
    bare = copy.copy(node)
    bare.body = [ast.Expr(ast.Constant(...))]
    if isinstance(bare, ast.FunctionDef | ast.ClassDef):
        bare.decorator_list = []
    elif not isinstance(bare, ast.With):
        bare.orelse = []
    return bare


def _head(node: ast.AST) -> str:
    """A statement in one line; of one with a body its first line."""
    return ast.unparse(_without_body(node)).splitlines()[0]


def brief(was: str, becomes: str) -> tuple[str, str]:
    """Two texts; where they are long, what differs and some words around it."""
    if max(len(was), len(becomes)) <= LONG:
        return was, becomes
    shorter = min(len(was), len(becomes))
    same = next((at for at in range(shorter) if was[at] != becomes[at]), shorter)
    tail = next(
        (at for at in range(shorter - same) if was[-1 - at] != becomes[-1 - at]), shorter - same
    )
    begin = was.rfind(" ", 0, max(same - AROUND, 0)) + 1
    rest = max(tail - AROUND, 0)
    rest -= rest and (was[len(was) - rest :].find(" ") + 1 and 0)
    first, last = "... " if begin else "", " ..." if rest else ""
    texts = (text[begin : len(text) - rest] for text in (was, becomes))
    before, after = (f"{first}{text}{last}" for text in texts)
    return before, after


def _lines(statement: ast.stmt) -> tuple[int, int]:
    """First and last line of a statement; of one with a body those of its head."""
    if isinstance(statement, _Compound):
        return statement.lineno, max(statement.body[0].lineno - 1, statement.lineno)
    return statement.lineno, statement.end_lineno or statement.lineno
