"""Commands that are declared once: options, help, Python documentation and output follow from a function.

A parameter that the shell has too carries an `Option` in its annotation, ``rate: Annotated[float, Option("Sample rate,
Hz")] = 100.0``; what belongs together carries a `Group`, a function whose own parameters are the options. `command`
marks the function; `gfimu.commands.shell.assemble.shell_command` makes the command of the program.
"""

from __future__ import annotations

import functools
import inspect
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal, ParamSpec, TypeVar, get_args, get_origin, overload

from gfimu.base.declared import Declared
from gfimu.base.errors import InputError, did_you_mean, unknown_name
from gfimu.base.files.outputs import Output, OutputFolder, check_outputs
from gfimu.base.lazy_names import declared_names
from gfimu.commands.shell.completion import beginning
from gfimu.commands.shell.named_files import files_named

__all__ = ["Command", "Group", "Option", "choices_of", "command", "command_of", "marked", "module_help"]

_Parameters = ParamSpec("_Parameters")
_Result = TypeVar("_Result")
_Python = TypeVar("_Python")
_Given = Mapping[str, Any]


@dataclass(frozen=True)
class Option:
    """An option of a command, which is a parameter of its function.

    Parameters
    ----------
    text : str
        Help line of the option, with the unit of its value.
    metavar : str
        Placeholder of the value in help, a unit or a kind of file.
    name : str
        Name of the option on the shell, where the parameter's name does not serve.
    kind : object
        Type of the value on the shell, where the Python parameter takes objects too; where it takes a path, a path.
    panel : str
        Heading under which help lists the option; empty for the first list.
    offers : callable or sequence of str, optional
        The words that shell completion offers, or what returns them with descriptions; a ``Literal`` offers its own.
    reads : bool
        Whether the value names files that the command reads, so that no output may replace them.
    writes : OutputFile or OutputFolder, optional
        Kind of output that the command writes at the path given.
    what : str or callable
        Name of the output in messages and JSON, where the parameter's name does not serve; a callable returns the name
        for a path.
    argument : bool
        Whether the shell takes the value by position, without an option name.
    shell : bool
        Whether the shell has the option; otherwise only Python has the parameter.
    needed : bool
        Whether the shell requires the option although the Python parameter has a default.
    least : float, optional
        Smallest number that the shell accepts.
    """

    text: str
    metavar: str = ""
    name: str = ""
    kind: Any = None
    panel: str = ""
    offers: Callable[[str], list[tuple[str, str]]] | Sequence[str] = ()
    reads: bool = False
    writes: Output | None = None
    what: str | Callable[[Path], str] = ""
    argument: bool = False
    shell: bool = True
    needed: bool = False
    least: float | None = None

    def also(self, more: str = "", *, when: str = "", **changes: Any) -> Option:
        """Return the option with a command's own words after its help line (`more`) or before it (`when`)."""
        return replace(self, text=f"{when}{self.text}{more}", **changes)

    def parameter(self, name: str, kind: Any) -> Any:
        """Return the Typer parameter of the option."""
        import typer  # not for those who call the function

        text = self.text if self.text.endswith((".", "?")) else f"{self.text}."
        words = self.offers or (get_args(kind) if get_origin(kind) is Literal else ())
        offers = words if callable(words) or not words else lambda incomplete: beginning(incomplete, words)
        settings: dict[str, Any] = {"help": text, "metavar": self.metavar or None, "autocompletion": offers or None}
        if self.argument:
            return typer.Argument(**settings)
        return typer.Option(self.flag(name), rich_help_panel=self.panel or None, min=self.least, **settings)

    def flag(self, name: str) -> str:
        """Return its name on the shell."""
        return self.name or f"--{name.replace('_', '-')}"


@dataclass(frozen=True)
class Group:
    """Options that belong together: one parameter in Python, several on the shell.

    Parameters
    ----------
    make : callable
        Builds the Python value; its parameters are the options.
    text : str
        Description of the value in the Python documentation.
    panel : str
        Heading under which help lists them.
    without : tuple of str
        Parameters of `make` that the command does not offer.
    reads : bool
        Whether the value may name a file that is read.
    """

    make: Callable[..., Any]
    text: str
    panel: str = ""
    without: tuple[str, ...] = ()
    reads: bool = False

    @property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Parameters of the options, by name."""
        found = {}
        for name, parameter in inspect.signature(self.make).parameters.items():
            if name not in self.without:
                kind, *marks = get_args(parameter.annotation)
                marks = [replace(mark, panel=self.panel) if isinstance(mark, Option) else mark for mark in marks]
                found[name] = parameter.replace(annotation=Annotated[kind, *marks])
        return found


@dataclass(frozen=True)
class Command:
    """A function with what the shell has to know besides its parameters.

    Parameters
    ----------
    name : str
        Its words on the shell, such as ``campaign status``.
    function : callable
        The function, unchecked.
    report : callable, optional
        Makes what is printed of the function's result and the arguments, by default the result itself: its ``to_dict``
        is the JSON, its ``shown`` yields tables and sentences.
    results : callable
        Returns the classes of what is printed, for the schema; by default those that the report returns, or the
        function.
    doing : str or callable
        What a progress bar says, or a function of the arguments that returns it; empty for none.
    run : callable, optional
        Does all that the shell does, from the arguments and whether JSON is asked for; for commands that print as they
        go. Its further parameters are options that the shell alone has.
    files : callable, optional
        Returns the files that were written, by what they are, from the function's result and the arguments; by default
        those that the arguments name.
    continues : bool
        Whether a call goes on where another ended: its pace so far says nothing of the time left.
    exit_code : callable, optional
        Returns the exit code of what is printed.
    gives : callable, optional
        Returns what Python gets of the function's result, where the report needs more than that.
    parts : tuple of callable
        Commands whose options the shell has besides; ``run`` calls the function or one of them.
    """

    name: str
    function: Callable[..., Any]
    report: Callable[[Any, _Given], Any] | None = None
    results: Callable[[], tuple[Any, ...]] = tuple
    doing: str | Callable[[_Given], str] = ""
    run: Callable[..., None] | None = None
    files: Callable[[Any, _Given], Mapping[str, Path]] | None = None
    continues: bool = False
    exit_code: Callable[[Any], int] | None = None
    gives: Callable[[Any], Any] | None = None
    parts: tuple[Callable[..., Any], ...] = ()

    @property
    def help(self) -> str:
        """Help on the shell: the docstring of the file, or the function's where that has a section ``Shell``.

        Of the function's docstring, what stands before its first section is the text, and the lines of ``Shell`` are
        the examples.
        """
        text = inspect.getdoc(self.function) or ""
        examples = _SHELL.search(text)
        if examples is None:
            return module_help(self.function)
        return f"{_SECTION.split(text, maxsplit=1)[0].rstrip()}\n\nExamples\n--------\n{examples[1]}"

    @functools.cached_property
    def parameters(self) -> dict[str, inspect.Parameter]:
        """Parameters of the function by name."""
        return dict(inspect.signature(self.function).parameters)

    @functools.cached_property
    def options(self) -> dict[str, Option]:
        """Options of the function itself, by parameter."""
        return marked(self.parameters, Option)

    @functools.cached_property
    def groups(self) -> dict[str, Group]:
        """Groups of options, by parameter."""
        return marked(self.parameters, Group)

    @functools.cached_property
    def shell_only(self) -> dict[str, inspect.Parameter]:
        """Parameters of the options that the shell alone has, by name."""
        parameters = {} if self.run is None else dict(inspect.signature(self.run).parameters)
        return {name: parameters[name] for name in marked(parameters, Option)}

    def names_files(self, kind: Any) -> bool:
        """Whether the files that were written are added to a result of this class, as it does not declare them."""
        declared = hasattr(kind, "keys") and "files" in {key.key for key in kind.keys().values()}
        return not declared and any(option.writes is not None for option in self.options.values())

    def check(self, given: _Given, also_read: _Given | None = None) -> None:
        """Refuse an unknown word, a number too small, and outputs that can't be written or would destroy an input."""
        for name, value in given.items():
            choices = choices_of(self.parameters[name])
            if choices and value is not None and value not in choices:
                raise unknown_name(name.rpartition("_")[2], value, choices)
            least = self.options[name].least if name in self.options else None
            if least is not None and value is not None and value < least:
                raise InputError(f"{name} {value}: must be {least:g} at least")
        outputs = [
            (option.flag(name).lstrip("-").replace("-", "_"), given[name], option.writes)
            for name, option in self.options.items()
            if option.writes is not None and given.get(name) is not None
        ]
        if outputs:
            read: dict[str, Option | Group] = {**self.options, **self.groups}
            inputs = {name: given[name] for name in given if name in read and read[name].reads}
            for name in self.groups.keys() & inputs.keys():
                inputs |= vars(inputs[name]) if is_dataclass(inputs[name]) else {}
            check_outputs(outputs, files_named({**inputs, **(also_read or {})}))

    def written(self, given: _Given) -> dict[str, Path]:
        """Return the files that the arguments name to be written, by what they are."""
        written: dict[str, Path] = {}
        for name, option in self.options.items():
            if option.writes is None or given.get(name) is None:
                continue
            if isinstance(option.writes, OutputFolder) and option.writes.meanings:
                files = zip(option.writes.meanings, option.writes.names, strict=True)
                written |= {meaning: given[name] / file for meaning, file in files}
            else:
                what = option.what(given[name]) if callable(option.what) else option.what
                written[what or name] = given[name]
        return written

    def taken(self, given: _Given) -> dict[str, Any]:
        """Return the arguments that it takes, of those of a command that takes more."""
        return {name: value for name, value in given.items() if name in self.parameters}

    def refused(self, error: TypeError, keywords: _Given) -> TypeError:
        """Return the error for a call that does not fit, with the right name of an argument."""
        for wrong in keywords.keys() - self.parameters.keys():
            for name, group in self.groups.items():
                if wrong in group.parameters:
                    part = f"it is part of {name}: {group.text}"
                    return TypeError(f"{self.function.__name__}() has no argument {wrong!r}; {part}")
            near = did_you_mean(wrong, self.parameters)
            return TypeError(f"{self.function.__name__}() has no argument {wrong!r}{near}")
        return TypeError(f"{self.function.__name__}(): {error}")


@overload
def command(
    name: str = "", *, gives: Callable[[_Result], _Python], **settings: Any
) -> Callable[[Callable[_Parameters, _Result]], Callable[_Parameters, _Python]]: ...


@overload
def command(
    name: str = "", *, gives: None = None, **settings: Any
) -> Callable[[Callable[_Parameters, _Result]], Callable[_Parameters, _Result]]: ...


def command(name: str = "", **settings: Any) -> Any:
    """Return the decorator that makes a function a command; the settings are those of `Command`."""

    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        results = functools.partial(_returned_results, settings.get("report"), function)
        declared = Command(name or function.__name__, function, **{"results": results, **settings})
        signature = inspect.signature(function)

        @functools.wraps(function)
        def called(*args: Any, **kwargs: Any) -> Any:
            try:
                given = signature.bind(*args, **kwargs).arguments
            except TypeError as error:
                raise declared.refused(error, kwargs) from None
            declared.check(given)
            found = function(*args, **kwargs)
            return found if declared.gives is None else declared.gives(found)

        called.__doc__ = _documented(function.__doc__ or "", declared)
        called.__signature__ = _plain_signature(signature, declared.gives)  # type: ignore[attr-defined]
        called.__command__ = declared  # type: ignore[attr-defined]
        return called

    return decorate


def module_help(function: Callable[..., Any]) -> str:
    """Return the docstring of the file of a command, which is the help of the command or of the group of commands."""
    return inspect.getdoc(inspect.getmodule(function)) or ""


def command_of(function: Callable[..., Any]) -> Command:
    """Return what a function declares."""
    declared: Command = function.__command__  # type: ignore[attr-defined]
    return declared


_Mark = TypeVar("_Mark", Option, Group)


def marked(parameters: Mapping[str, inspect.Parameter], kind: type[_Mark]) -> dict[str, _Mark]:
    """Return what the annotations of parameters declare of one kind, by name."""
    found = {}
    for name, parameter in parameters.items():
        marks = getattr(parameter.annotation, "__metadata__", ())
        of_kind = [mark for mark in marks if isinstance(mark, kind)]
        if of_kind:
            found[name] = of_kind[-1]  # the command's own words, where it says more than the shared parameter
    return found


def choices_of(parameter: inspect.Parameter) -> tuple[Any, ...]:
    """Return the words that a parameter takes; none where it takes others too."""
    kind = getattr(parameter.annotation, "__origin__", None)
    kinds = get_args(kind) if get_origin(kind) is not Literal else (kind,)
    return next((get_args(one) for one in kinds if get_origin(one) is Literal), ())


def _returned_results(*functions: Callable[..., Any] | None) -> tuple[type[Declared], ...]:
    """Return the results that the return annotation of the first function names that names any.

    They stand in the file of the function, which may import them for types only.
    """
    for function in filter(None, functions):
        names = re.findall(r"\w+", str(inspect.signature(function).return_annotation))
        module = inspect.getmodule(function)
        load, _, imported = declared_names(function.__module__)
        kinds = [load(name) if name in imported else vars(module).get(name) for name in names]
        if results := tuple(kind for kind in kinds if isinstance(kind, type) and issubclass(kind, Declared)):
            return results
    return ()


def _plain_signature(signature: inspect.Signature, gives: Callable[[Any], Any] | None) -> inspect.Signature:
    """Return a signature with the types alone, as `help` shows it, and what Python gets."""
    parameters = [one.replace(annotation=_type_text(one.annotation)) for one in signature.parameters.values()]
    returned = inspect.signature(gives) if gives else signature
    return signature.replace(parameters=parameters, return_annotation=returned.return_annotation)


def _type_text(annotation: Any) -> Any:
    kind = getattr(annotation, "__origin__", annotation) if hasattr(annotation, "__metadata__") else annotation
    return getattr(kind, "__forward_arg__", kind)


def _paragraph(text: str) -> str:
    ended = text if text.endswith((".", "?")) else f"{text}."
    return textwrap.fill(ended, 110, initial_indent=" " * 8, subsequent_indent=" " * 8, break_on_hyphens=False)


_SECTION = re.compile(r"^ *(?:Returns|Raises|Examples|Notes|Shell)\n *-+$", re.MULTILINE)
_SHELL = re.compile(r"^ *Shell\n *-+\n((?: *\S.*(?:\n|$))+)(?: *\n)*", re.MULTILINE)


def _documented(text: str, declared: Command) -> str:
    """Return a docstring with the parameters, which their declarations describe, before its first section.

    Its section ``Shell`` is no part of it.
    """
    text = _SHELL.sub("", text)
    rows = []
    for name, parameter in declared.parameters.items():
        mark = declared.options.get(name) or declared.groups.get(name)
        if mark is not None:
            kind = inspect.formatannotation(_type_text(parameter.annotation)).strip("'")
            optional = "" if parameter.default is inspect.Parameter.empty else ", optional"
            rows.append(f"    {name} : {kind}{optional}\n{_paragraph(mark.text)}\n")
    if not rows:
        return text
    section = "    Parameters\n    ----------\n" + "".join(rows) + "\n"
    found = _SECTION.search(text)
    return text[: found.start()] + section + text[found.start() :] if found else f"{text.rstrip()}\n\n{section}    "
