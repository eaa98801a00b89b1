"""Turns plain tables into attrs classes through cattrs, and every error into a `Problem`.

A class of this package annotates each field `Annotated[type, rule]` with a rule of
`rules.py`; a field without a default must stand in the file.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

import attrs
import cattrs
from cattrs.errors import ClassValidationError, ForbiddenExtraKeysError
from cattrs.gen import make_dict_structure_fn, override

from hil_tests.config.report import Problem, Wrong, near_miss

Table = TypeVar("Table")

_UNIT_SUFFIXES = ("_ns", "_ppm")


def structure(document: Mapping[str, object], shape: type[Table]) -> Table | list[Problem]:
    """The document as an instance of `shape`, or everything that is wrong with it."""
    try:
        return _converter().structure(document, shape)
    except ClassValidationError as error:
        return list(_problems(error, shape, document, (), _homes(shape)))


def file_key(attribute: str) -> str:
    """The key of a field in the file: units stand in its value there, not in its name."""
    for suffix in _UNIT_SUFFIXES:
        attribute = attribute.removesuffix(suffix)
    return attribute


def table(document: Mapping[str, object], *path: str) -> Mapping[str, object]:
    """The table at `path`, or an empty one where there is none."""
    inner: object = document
    for key in path:
        inner = inner.get(key) if isinstance(inner, Mapping) else None
    return inner if isinstance(inner, Mapping) else {}


@functools.cache  # it compiles a function a class: 10 ms, and is never changed again
def _converter() -> cattrs.Converter:
    converter = cattrs.Converter(forbid_extra_keys=True, detailed_validation=True)
    converter.register_structure_hook_func(
        lambda kind: hasattr(kind, "__metadata__"),
        lambda value, kind: kind.__metadata__[0].read(value),
    )
    converter.register_structure_hook_factory(
        attrs.has, lambda shape: _table_hook(shape, converter)
    )
    return converter


def _table_hook(shape: type[Any], converter: cattrs.Converter) -> Callable[[Any, Any], Any]:
    renamed = {field.name: override(rename=file_key(field.name)) for field in attrs.fields(shape)}
    fill = make_dict_structure_fn(
        shape,
        converter,
        _cattrs_forbid_extra_keys=True,
        _cattrs_detailed_validation=True,
        **renamed,  # type: ignore[arg-type]  # cattrs types its keyword options as one
    )

    def hook(value: Any, _: Any) -> Any:
        if not isinstance(value, Mapping):
            raise Wrong.one(value, "write a table: a [section], or { key = value }")
        return fill(value, shape)

    return hook


def _problems(
    error: ClassValidationError,
    shape: type[Any],
    raw: Mapping[str, object],
    path: tuple[str, ...],
    homes: Mapping[str, str],
) -> Iterable[Problem]:
    """Walks what cattrs found, in step with the tables of the file."""
    fields = attrs.fields_dict(shape)
    noted, others = error.group_exceptions()
    for inner, note in noted:
        key = file_key(note.name)
        if key not in raw:
            place = f"key to [{'.'.join(path)}]" if path else "section"
            yield Problem((*path, key), f"is missing; add this {place}")
        elif isinstance(inner, ClassValidationError):
            deeper = _class_of(fields[note.name].type)
            yield from _problems(inner, deeper, table(raw, key), (*path, key), homes)
        else:
            yield from _valued(inner, (*path, key), raw[key])
    known = [file_key(name) for name in fields]
    for other in others:
        extra = other.extra_fields if isinstance(other, ForbiddenExtraKeysError) else set()
        for key in sorted(extra):
            yield Problem((*path, key), f"unknown key; {_remedy(key, known, path, homes)}")


def _valued(error: BaseException, path: tuple[str, ...], value: object) -> Iterable[Problem]:
    if not isinstance(error, Wrong):
        yield Problem(path, f"cannot be used: {error}", value)
        return
    for problem in error.problems:
        yield Problem((*path, *problem.path), problem.what, problem.value)


def _remedy(
    key: str, known: Iterable[str], path: tuple[str, ...], homes: Mapping[str, str]
) -> str:
    """Another section's key stands in the wrong place; others are slips of the pen."""
    home = homes.get(key)
    if home is not None and home != ".".join(path):
        return f"it belongs in [{home}]"
    return near_miss(key, known)


def _homes(shape: type[Any], path: tuple[str, ...] = ()) -> dict[str, str]:
    """The section of every key that exists in one place only."""
    found: dict[str, list[str]] = {}
    for name, field in attrs.fields_dict(attrs.resolve_types(shape)).items():
        inner = _class_of(field.type)
        if inner is None:
            found.setdefault(file_key(name), []).append(".".join(path))
            continue
        for key, home in _homes(inner, (*path, file_key(name))).items():
            found.setdefault(key, []).append(home)
    return {key: homes[0] for key, homes in found.items() if len(homes) == 1 and homes[0]}


def _class_of(kind: Any) -> Any:
    """The attrs class in an annotation `X` or `X | None`, else None."""
    choices = (kind, *getattr(kind, "__args__", ()))
    return next((one for one in choices if isinstance(one, type) and attrs.has(one)), None)
