"""Calls of all public classes and functions as nobody means them, in both libraries: what each answers or raises.

    python tools/odd_calls.py [SUBJECT ...] [--only REGEX] [--out FILE.jsonl]      # writes what differs
    python tools/odd_calls.py --summary FILE.jsonl [--theirs TypeError] [--ours ValueError]

A subject is an object of `tests/crosscheck/pydrake/none_calls.py` (`plant`, `joint` ...), a class of
`benchmarks/_objects.py`, any public class (its constructors), or a module (its functions). For each form that a
docstring of Drake states, arguments are sought that Drake takes. The call is then made with them by position and by
name, and with one argument at a time left out, misnamed, too many, or of another kind: None, of another class, of
another plant, an array of another shape, order or type, not a number ... Answers are compared in depth, exceptions by
class. Each form has a process of its own, which is forked again behind the case that ended it. All of it takes half an
hour; `--part 0/6` a sixth, `--again FILE` the forms of which an earlier run had something to say.
"""

from __future__ import annotations

import argparse
import collections
import contextlib
import inspect
import itertools
import json
import os
import pathlib
import re
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "src"), str(ROOT / "tests/crosscheck/pydrake")]

from benchmarks._objects import OBJECTS  # noqa: E402
from benchmarks.every_class import MODULES, Arguments, Call, Library, calls_of, context, unequal  # noqa: E402

SECONDS = 2  # of one call
MOST_CHOICES = 40
LEFT_ALONE = re.compile(
    r"Graphviz|Write|Start|Stop|Dump|Download|AddRemote|PopulateFrom|Publish|Meshcat|WebSocket|Flush|Lcm|"
    r"HandleSubscr|Monte|AdvanceTo|Integrate\w+Time$|Batch|^_(?!_)|𝓤$|Iris|Iterat|SolveInParallel|UsePython|Do[A-Z]|"
    r"^__(?!(init|add|sub|mul|matmul|truediv|neg|pow|getitem|setitem|len|eq|ne|lt|le|gt|ge|call|contains|"
    r"r(add|sub|mul|truediv|pow))__)\w+__$"
)
"""Names of what opens files, pages and sockets, or takes long."""
ANY = (
    "None", "'abc'", "object()", "{}", "[]", "3", "-1", "0.5", "True", "np.nan", "[1.0]", "np.zeros(3)",
    "np.zeros((2, 3))", "RigidTransform()", "Variable('a')", "AutoDiffXd(0.5, [1.0])", "lambda *a: None",
)  # fmt: skip
"""What is put in the place of every argument."""
OF_NUMBER = (
    "np.float32({0})", "np.int64({0})", "int({0})", "np.array({0})", "np.array([{0}])", "np.array([[{0}]])", "-{0}",
    "np.inf", "1j", "str({0})", "Expression({0})", "AutoDiffXd({0})", "np.bool_(True)", "10**30",
)  # fmt: skip
OF_ARRAY = (
    "{0}.tolist()", "tuple({0})", "np.asfortranarray({0})", "{0}.astype(np.float32)", "{0}.astype(int)",
    "{0}.astype(object)", "{0}.astype(complex)", "{0}.reshape(-1, 1)", "{0}[None]", "np.append({0}, 1.0)", "{0}[:-1]",
    "np.zeros(0)", "np.zeros((0, 0))", "np.array(0.5)", "{0} * np.nan", "np.repeat({0}, 2, axis=0)[::2]",
    "[AutoDiffXd(x) for x in np.ravel({0})]", "[str(x) for x in np.ravel({0})]",
)  # fmt: skip
OF_LIST = ("tuple({0})", "{0}[:-1]", "[None]", "[3]", "np.array({0})", "set({0})", "{0} + {0}", "['abc']")


class Case(NamedTuple):
    """A call as text: what is called, and its arguments, as expressions."""

    function: str
    args: tuple[str, ...]
    named: tuple[tuple[str, str], ...] = ()
    odd: str = ""

    def __str__(self) -> str:
        return f"{self.function}({', '.join([*self.args, *(f'{k}={v}' for k, v in self.named)])})"


class Both:
    """Both libraries, their objects, and arguments for them."""

    def __init__(self) -> None:
        import none_calls

        self.libraries = {name: Library(name) for name in ("pydrake", "sheldrake")}
        self.arguments = Arguments(self.libraries["pydrake"])
        self.of_class: dict[str, str] = {}
        for name, library in self.libraries.items():
            scene, other = none_calls.objects(name), none_calls.objects(name)
            library.names.update(scene | {f"other_{key}": value for key, value in other.items()})
            library.names.update(_context=lambda s, library=library: context_of(library, s), inf=np.inf, nan=np.nan)
            library.names["_cls"] = {f"{m}.{k}": v for m in MODULES for k, v in vars(library.modules[m]).items()}
        self.scene = scene
        for key in scene:
            for base in type(self.libraries["pydrake"].names[key]).__mro__[:-1]:
                self.of_class.setdefault(re.sub("_?𝓣float𝓤", "", base.__name__), key)
        self.of_class["RigidBody"], self.of_class["Frame"] = "body", "frame"

    def candidates(self, name: str, kind: str) -> list[str]:
        """Expressions for an argument, the likeliest first."""
        short = re.sub("_?𝓣float𝓤", "", kind).split(".")[-1]
        if short == "Context":
            return ["_context(s)"]
        found = [self.of_class[short]] if short in self.of_class and OBJECTS.get(short, "None") == "None" else []
        with contextlib.suppress(Exception):
            found += [given.text for given in map(Text, self.arguments.candidates(name, kind)) if given.text]
        return found


class Text:
    """The expression in a candidate of `Arguments`, which evaluates it."""

    def __init__(self, given: Callable[..., Any]) -> None:
        self.text = ""
        cells = dict(zip(given.__code__.co_freevars, (c.cell_contents for c in given.__closure__ or ())))
        if "expression" in cells:
            self.text = cells["expression"]
        elif "made" in cells and (one := Text(cells["made"]).text):
            self.text = f"[{', '.join([one] * cells['count'])}]"
        elif given is context:
            self.text = "_context(s)"


def context_of(library: Library, subject: Any) -> Any:
    """The context that a subject of the scene is asked with, or one of its own."""
    names = library.names
    for key in ("plant", "scene_graph", "diagram"):
        if subject is names[key]:
            return {"plant": names["plant_context"], "diagram": names["context"]}.get(key) or names[
                "scene_graph"
            ].GetMyContextFromRoot(names["context"])
    if hasattr(subject, "CreateDefaultContext"):
        return context(library, subject)
    return names["context"] if subject is names["simulator"] else names["plant_context"]


def variations(case: Case, value_of: Callable[[str], Any], names: tuple[str, ...], scene: Any) -> Iterator[Case]:
    """The call by name, and with one thing wrong."""
    args = case.args
    if all(names):
        for k in range(len(args)):
            yield case._replace(args=args[:k], named=tuple(zip(names[k:], args[k:])))
        if args:
            yield case._replace(args=(), named=(("oops", args[0]), *zip(names[1:], args[1:])))
    yield case._replace(args=(*args, "None"))
    yield case._replace(args=(*args, "3"))
    yield case._replace(named=(("oops", "3"),))
    for k, text in enumerate(args):
        yield case._replace(args=args[:k] + args[k + 1 :])
        other: list[str] = list(ANY)
        value = value_of(text)
        if text in scene:
            other.append(f"other_{text}")
        if text == "_context(s)":
            other += ["other_plant_context", "context", "adder.CreateDefaultContext()", "other_diagram"]
        if isinstance(value, np.ndarray):
            other += OF_ARRAY
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            other += OF_NUMBER
        elif isinstance(value, list):
            other += OF_LIST
        for each in other:
            put = each.replace("{0}", f"({text})")
            yield case._replace(args=(*args[:k], put, *args[k + 1 :]), odd=each)


class Form:
    """One form of a call of one subject, in a process of its own."""

    def __init__(self, both: Both, subject: str, call: Call) -> None:
        self.both, self.subject, self.call = both, subject, call
        self.options = [both.candidates(name, kind) for name, kind, _ in call.parameters]
        self.names = tuple("" if re.fullmatch(r"arg\d+", name) else name for name, _, _ in call.parameters)

    def outcome(self, library: str, case: Case) -> tuple[Any, BaseException | None]:
        """What the call answers or raises."""
        names = self.both.libraries[library].names
        try:
            function = eval(case.function, names)
            args, named = [eval(a, names) for a in case.args], {k: eval(v, names) for k, v in case.named}
        except Exception as error:
            return None, NameError(f"{type(error).__name__}: {error}")  # there is no such thing
        signal.alarm(SECONDS)
        try:
            return function(*args, **named), None
        except (Exception, SystemExit) as error:
            return None, error
        finally:
            signal.alarm(0)

    def value_of(self, text: str) -> Any:
        """What an argument is in Drake."""
        with contextlib.suppress(Exception):
            return eval(text, self.both.libraries["pydrake"].names)
        return None

    def run(self, ended: list[str], tell: Callable[[Any], None]) -> None:
        """Tells of each case what differs; those that ended a process, as `library: call`, are left out."""
        for library in self.both.libraries.values():
            library.names["s"] = library.make(self.subject) if self.subject else None
        function = {"function": self.call.owner, "new": self.call.owner}.get(self.call.kind, f"s.{self.call.name}")
        base = None
        for choice in itertools.islice(itertools.product(*self.options), MOST_CHOICES):
            case = Case(function, choice)
            if f"pydrake: {case}" in ended:
                continue
            tell(f"pydrake: {case}")
            if self.outcome("pydrake", case)[1] is None:
                base = case
                break
        taken = base is not None
        base = base or Case(function, tuple(each[0] for each in self.options))
        cases = [base, *variations(base, self.value_of, self.names, self.both.scene)]
        for case in dict.fromkeys(cases):
            if any(f"{name}: {case}" in ended for name in self.both.libraries):
                continue
            for library in self.both.libraries.values():  # what the last one changed is no business of this one
                library.names["s"] = (
                    library.make(self.subject) if self.subject in OBJECTS.values() else library.names["s"]
                )
            tell(f"pydrake: {case}")
            theirs, refused = self.outcome("pydrake", case)
            tell(f"sheldrake: {case}")
            ours, error = self.outcome("sheldrake", case)
            if isinstance(refused, NameError) or (isinstance(refused, SystemExit) and error is not None):
                continue  # Drake's assertions are nobody's to catch
            found = {
                "theirs": name_of(refused),
                "ours": name_of(error),
                "normal": taken and case == base,
                "odd": case.odd,
            }
            if refused is None and error is None:
                tell("comparison")
                found["differs"] = unequal(ours, theirs)
            if found["theirs"] != found["ours"] or found.get("differs"):
                text = str(error or "").strip().splitlines()[:1]
                found |= {"form": self.call.title(), "call": str(case), "text": text[0][:200] if text else ""}
                found["theirs_text"] = " ".join(str(refused or "").split())[:150]
                tell(found)
            else:
                tell({"same": True})


def name_of(error: BaseException | None) -> str:
    """The class of an error by which it is caught; nothing for an answer."""
    if error is None or type(error).__module__ == "builtins":
        return "" if error is None else type(error).__name__
    return next(base.__name__ for base in type(error).__mro__ if base.__module__ == "builtins")


def apart(form: Form) -> Iterator[dict]:
    """What one form tells."""
    ended: list[str] = []
    seen: set[str] = set()
    while len(ended) < 12:
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reader)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            quiet = os.open(os.devnull, os.O_WRONLY)
            os.dup2(quiet, 1)
            os.dup2(quiet, 2)
            try:
                with os.fdopen(writer, "w", buffering=1) as told:
                    form.run(ended, lambda what, told=told: print(json.dumps(what), file=told))
                    print('"done"', file=told)
            finally:
                os._exit(0)
        os.close(writer)
        at = ""
        with os.fdopen(reader) as lines:
            for line in lines:
                found = json.loads(line)
                if isinstance(found, dict):
                    if found.get("call", "") not in seen:
                        yield found
                    seen.add(found.get("call", "same"))
                else:
                    at = found if found != "comparison" else at
        _, status = os.waitpid(child, 0)
        if at in ("done", ""):
            return
        ended.append(at)
        yield {"ended": at, "status": status, "form": form.call.title(), "call": at}


def forms(both: Both, subjects: list[str], only: str) -> Iterator[Form]:
    """All forms of calls of subjects, of all where none is named."""
    drake = both.libraries["pydrake"]
    made = {name: OBJECTS[name] for name in OBJECTS if OBJECTS[name] != "None"} | {name: name for name in both.scene}
    seen: set[Any] = set()
    for name, expression in made.items():
        try:
            kind = type(drake.make(expression))
        except (Exception, SystemExit):  # some objects are of a later Drake
            continue
        for member in dir(kind):
            function = getattr(kind, member, None)
            if LEFT_ALONE.search(member) or member == "__init__" or not callable(function):
                continue
            for call in dict.fromkeys(calls_of(name, member, function.__doc__ or "", True)):
                key = (member, function.__doc__, call.parameters)
                if key not in seen and (not subjects or name in subjects) and re.search(only, call.title()):
                    seen.add(key)
                    yield Form(both, expression, call)
    for module in MODULES[1:]:
        for name, function in sorted(vars(drake.modules[module]).items()):
            where = f"_cls['{module}.{name}']"
            if LEFT_ALONE.search(name) or not callable(function) or not (name.isascii() and function not in seen):
                continue
            if not str(getattr(function, "__module__", "")).startswith("pydrake") or hasattr(function, "__members__"):
                continue
            seen.add(function)
            member = "__init__" if inspect.isclass(function) else name
            text = (function.__init__ if inspect.isclass(function) else function).__doc__ or ""
            for call in dict.fromkeys(calls_of(where, member, text, inspect.isclass(function))):
                if (not subjects or {module, name} & {*subjects}) and re.search(only, call.title()):
                    yield Form(both, "", call)


def summary(path: pathlib.Path, theirs: str | None, ours: str | None) -> None:
    """Prints how many cases have which pair of outcomes, or those of one pair."""
    found = [json.loads(line) for line in path.read_text().splitlines()]
    if theirs is None and ours is None:
        pairs = collections.Counter(
            (d.get("theirs"), d.get("ours"), bool(d.get("differs"))) for d in found if "theirs" in d
        )
        for (a, b, differs), count in pairs.most_common():
            print(f"{count:6d}  Drake {a or 'answers':20s} here {b or 'answers'}{' otherwise' if differs else ''}")
        for library in ("pydrake", "sheldrake"):
            print(f"{sum(d.get('ended', '').startswith(library) for d in found):6d}  ended by {library}")
        return
    for d in found:
        if d.get("theirs") == (theirs or "") and d.get("ours") == (ours or ""):
            print(f"{d['call']}  [{d['form']}]\n      {d.get('differs') or d['text']}  | {d['theirs_text'][:90]}")


def main() -> None:
    """Writes what differs, or counts what was written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("subjects", nargs="*")
    parser.add_argument("--only", default="", help="forms whose title contains this regular expression")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("odd_calls.jsonl"))
    parser.add_argument("--part", default="0/1", help="every so manieth form, from this one on: 0/2 and 1/2 are all")
    parser.add_argument("--again", type=pathlib.Path, help="only forms of which this file of an earlier run has a line")
    parser.add_argument("--summary", type=pathlib.Path)
    parser.add_argument("--theirs")
    parser.add_argument("--ours")
    options = parser.parse_args()
    if options.summary:
        summary(options.summary, options.theirs, options.ours)
        return
    import pydrake.all  # noqa: F401  (which sets filters of its own)

    warnings.simplefilter("ignore")
    first, step = map(int, options.part.split("/"))
    both, count, same = Both(), 0, 0
    lines = options.again.read_text().splitlines() if options.again else []
    again = {json.loads(line)["form"] for line in lines}
    chosen = (f for f in forms(both, options.subjects, options.only) if not lines or f.call.title() in again)
    with options.out.open("w") as out:
        for form in itertools.islice(chosen, first, None, step):
            count += 1
            if not all(form.options):
                continue
            for found in apart(form):
                same += found.get("same", False)
                if "same" not in found:
                    out.write(json.dumps(found) + "\n")
            out.flush()
    print(f"{count} forms, {same} cases alike")


if __name__ == "__main__":
    main()
