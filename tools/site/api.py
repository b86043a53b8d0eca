"""What the pages of the API show, as an extension of Griffe, named in mkdocs.yml.

Examples are fenced, for Markdown would take `>>>` for nested quotations. Functions come before
classes. A class whose constructor is made from its fields, as an Equinox module's or a named
tuple's is, shows that constructor.
"""

import re
from typing import Any

import griffe

_EXAMPLE = re.compile(r"^>>> .*(?:\n.+)*", re.MULTILINE)
# Bases that make a constructor from annotated fields.
_BY_FIELDS = {"equinox.Module", "eqx.Module", "typing.NamedTuple", "NamedTuple"}


class ApiPages(griffe.Extension):
    """Prepare docstrings, the order of names, and constructors."""

    def on_instance(self, *, obj: griffe.Object, **_: Any) -> None:
        if obj.docstring:
            obj.docstring.value = _EXAMPLE.sub(r"```pycon\n\g<0>\n```", obj.docstring.value)

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        for module in (pkg, *_folders(pkg)):
            for one in list(module.members.values()):
                for member in _members(one):
                    if isinstance(member, griffe.Class):
                        _add_constructor(member)
                    for function in (member, *_members(member)):
                        if isinstance(function, griffe.Function):
                            for parameter in function.parameters:
                                parameter.annotation = _spelled(parameter.annotation)
        for module in _folders(pkg):
            if module.exports:
                names = [name if isinstance(name, str) else name.name for name in module.exports]
                ranks = {name: _rank(module.members[name]) for name in names}
                module.exports = [*sorted(names, key=ranks.__getitem__)]


def _members(one: Any) -> list[Any]:
    return list(one.members.values()) if isinstance(one, griffe.Module | griffe.Class) else []


def _spelled(annotation: Any) -> Any:
    """The annotation with each name of a `Literal` replaced by its options."""
    if isinstance(annotation, griffe.ExprBinOp):
        left, right = _spelled(annotation.left), _spelled(annotation.right)
        return griffe.ExprBinOp(left, annotation.operator, right)
    if isinstance(annotation, griffe.ExprName):
        try:
            target: Any = annotation.parent[annotation.name]  # pyright: ignore
            target = target.final_target if target.is_alias else target
        except (KeyError, griffe.AliasResolutionError):
            return annotation
        if target.is_attribute and str(target.value).startswith("Literal["):
            return target.value
    return annotation


def _folders(pkg: griffe.Module) -> list[griffe.Module]:
    return [one for one in pkg.members.values() if isinstance(one, griffe.Module)]


def _rank(member: griffe.Object | griffe.Alias) -> int:
    """0 for functions, 1 for classes, 2 for the rest; `sorted` keeps the names' order within."""
    if member.is_function:
        return 0
    return 1 if member.is_class else 2


def _is_by_fields(cls: griffe.Class) -> bool:
    known = {str(base).split("[")[0] for base in cls.bases}
    return bool(known & _BY_FIELDS) or any(
        _is_by_fields(base) for base in cls.resolved_bases if isinstance(base, griffe.Class)
    )


def _add_constructor(cls: griffe.Class) -> None:
    if "__init__" in cls.all_members or cls.name.startswith("Abstract") or not _is_by_fields(cls):
        return
    found: dict[str, griffe.Parameter] = {}
    for owner in (*reversed(cls.mro()), cls):
        for field in owner.attributes.values():
            default = _default(field)
            if field.annotation is None or "property" in field.labels or default is ...:
                continue
            found[field.name] = griffe.Parameter(
                field.name,
                annotation=field.annotation,
                kind=griffe.ParameterKind.positional_or_keyword,
                default=default,
            )
    if not found:
        return
    this = griffe.Parameter("self", kind=griffe.ParameterKind.positional_or_keyword)
    parameters = griffe.Parameters(this, *found.values())
    init = griffe.Function("__init__", lineno=0, endlineno=0, parent=cls, parameters=parameters)
    cls.set_member("__init__", init)


def _default(field: griffe.Attribute) -> Any:
    """A field's default, None where it has none, and ... where it is no argument."""
    if isinstance(field.annotation, griffe.Expr) and "ClassVar" in str(field.annotation):
        return ...
    if "class-attribute" in field.labels and "instance-attribute" not in field.labels:
        return ...
    value = field.value
    if not (isinstance(value, griffe.ExprCall) and str(value.function).endswith("field")):
        return value
    options = {
        one.name: one.value for one in value.arguments if isinstance(one, griffe.ExprKeyword)
    }
    if str(options.get("init")) == "False":
        return ...
    return options.get("default")
