"""Mutation operators: what small changes a node of a syntax tree allows.

Each is a function of the node and its place, and yields what may stand there instead. They
change tables, constants and single statements as well as conditions: a keypad is largely
tables.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeVar

Node = TypeVar("Node", bound=ast.AST)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a node stands.

    Args:
        parent: what it is a part of.
        field: as which part.
        returns: annotation of what the function around it returns.
    """

    parent: ast.AST
    field: str = ""
    returns: str = ""


_COMPARISONS: Mapping[type[ast.cmpop], Sequence[type[ast.cmpop]]] = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}

_ARITHMETIC: Mapping[type[ast.operator], Sequence[type[ast.operator]]] = {
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.FloorDiv,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.FloorDiv,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.BitXor: (ast.BitAnd, ast.BitOr),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
}

_WORDS: Mapping[str, str] = {"big": "little", "little": "big"}
"""Texts that act."""

_CALLS: Mapping[str, str] = {"min": "max", "max": "min", "any": "all", "all": "any"}

_MEMBERS: Mapping[str, Sequence[str]] = {
    "NmtState": ("INITIALISING", "STOPPED", "OPERATIONAL", "PRE_OPERATIONAL"),
    "NmtCommand": ("START", "STOP", "PRE_OPERATIONAL", "RESET_NODE", "RESET_COMMUNICATION"),
}
"""Enumerations whose members may be mistaken for one another."""


def _with(node: Node, **fields: object) -> Node:
    """A copy of a node with other fields."""
    copied = copy.copy(node)
    for name, value in fields.items():
        setattr(copied, name, value)
    return copied


def comparisons(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """Boundary moved, or the comparison turned round."""
    if isinstance(node, ast.Compare):
        for index, operator in enumerate(node.ops):
            for other in _COMPARISONS[type(operator)]:
                yield _with(node, ops=[*node.ops[:index], other(), *node.ops[index + 1 :]])


def arithmetic(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """Another operation; a sign or an inversion dropped; an update that only sets."""
    if isinstance(node, ast.BinOp | ast.AugAssign):
        for other in _ARITHMETIC.get(type(node.op), ()):
            yield _with(node, op=other())
    if isinstance(node, ast.AugAssign):
        yield ast.Assign([node.target], node.value)
    if isinstance(node, ast.UnaryOp):
        yield node.operand


def constants(node: ast.AST, place: Place) -> Iterator[ast.AST]:
    """Numbers one more and one less, the other truth, the other byte order, None as 0."""
    if not isinstance(node, ast.Constant):
        return
    value = node.value
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        yield ast.Constant(value + 1)
        yield ast.Constant(value - 1)
    elif isinstance(value, str) and value in _WORDS:
        yield ast.Constant(_WORDS[value])
    elif isinstance(value, bytes):
        yield ast.Constant(value[1:] if value else b"\x00")
    elif value is None and place.field == "value" and isinstance(place.parent, _HOLDERS):
        yield ast.Constant(0)


_HOLDERS = (ast.Assign, ast.AnnAssign, ast.keyword)


def booleans(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """And for or, and each operand dropped."""
    if isinstance(node, ast.BoolOp):
        yield _with(node, op=ast.Or() if isinstance(node.op, ast.And) else ast.And())
        for index in range(len(node.values)):
            rest = [*node.values[:index], *node.values[index + 1 :]]
            yield rest[0] if len(rest) == 1 else _with(node, values=rest)


def conditions(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """Always, never, and the other way round; a filter dropped."""
    if isinstance(node, ast.IfExp):
        yield node.body
        yield node.orelse
    if isinstance(node, ast.If):
        yield _with(node, test=ast.Constant(value=True))
    if isinstance(node, ast.If | ast.While):
        yield _with(node, test=ast.Constant(value=False))
        if not isinstance(node.test, ast.Compare | ast.UnaryOp):
            yield _with(node, test=ast.UnaryOp(ast.Not(), node.test))
    if isinstance(node, ast.comprehension):
        for index in range(len(node.ifs)):
            yield _with(node, ifs=[*node.ifs[:index], *node.ifs[index + 1 :]])


def statements(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """Left out: calls, assignments to what lasts, updates, loops, refusals."""
    lasts = isinstance(node, ast.Assign | ast.AnnAssign) and any(
        isinstance(part, ast.Attribute | ast.Subscript)
        for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        for part in ast.walk(target)
    )
    calls = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    if lasts or calls or isinstance(node, ast.AugAssign | ast.For | ast.Raise):
        yield ast.Pass()


def returns(node: ast.AST, place: Place) -> Iterator[ast.AST]:
    """Another result, such as the annotation allows."""
    if not isinstance(node, ast.Return) or node.value is None or _is_nothing(node.value):
        return
    value = node.value
    others: list[ast.expr] = []
    if place.returns == "bool":
        others = [ast.Constant(value=True), ast.Constant(value=False)]
    elif place.returns == "Frames":
        twice: list[ast.expr] = [ast.Starred(value, ast.Load()) for _ in range(2)]
        others = [ast.Tuple([], ast.Load()), ast.Tuple(twice, ast.Load())]
    elif place.returns == "int":
        others = [ast.Constant(0)]
    elif place.returns.endswith("| None"):
        others = [ast.Constant(None)]
    for other in others:
        yield ast.Return(other)


def _is_nothing(value: ast.expr) -> bool:
    """Twice nothing is nothing."""
    return isinstance(value, ast.Name) and value.id == "NOTHING"


def calls(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """The opposite function."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _CALLS:
        yield _with(node, func=ast.Name(_CALLS[node.func.id], ast.Load()))


def displays(node: ast.AST, place: Place) -> Iterator[ast.AST]:
    """An entry missing from a tuple, list, set or table; two entries the other way round."""
    if isinstance(node, ast.Tuple | ast.List | ast.Set) and len(node.elts) > 1:
        if isinstance(node, ast.Tuple | ast.List) and not isinstance(node.ctx, ast.Load):
            return
        # Of what is assigned to several names none can be missing.
        for index in range(len(node.elts) if not isinstance(place.parent, ast.Assign) else 0):
            yield _with(node, elts=[*node.elts[:index], *node.elts[index + 1 :]])
        if len(node.elts) == 2 and not isinstance(node, ast.Set):
            yield _with(node, elts=node.elts[::-1])
    if isinstance(node, ast.Dict):
        for index in range(len(node.keys)):
            keys = [*node.keys[:index], *node.keys[index + 1 :]]
            values = [*node.values[:index], *node.values[index + 1 :]]
            yield _with(node, keys=keys, values=values)


def slices(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """A bound dropped."""
    if isinstance(node, ast.Slice):
        if node.lower is not None:
            yield _with(node, lower=None)
        if node.upper is not None:
            yield _with(node, upper=None)


def members(node: ast.AST, _: Place) -> Iterator[ast.AST]:
    """The next member of the enumeration."""
    if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
        names = _MEMBERS.get(node.value.id, ())
        if node.attr in names:
            yield _with(node, attr=names[(names.index(node.attr) + 1) % len(names)])


OPERATORS: tuple[Callable[[ast.AST, Place], Iterator[ast.AST]], ...] = (
    statements,
    conditions,
    returns,
    comparisons,
    booleans,
    arithmetic,
    constants,
    calls,
    displays,
    slices,
    members,
)


def alternatives(node: ast.AST, place: Place) -> Iterator[ast.AST]:
    """Everything that may stand in the place of a node."""
    return chain.from_iterable(operator(node, place) for operator in OPERATORS)
