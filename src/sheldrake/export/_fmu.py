"""SaveFmu: a diagram as a Functional Mock-up Unit for co-simulation, which brings its machine code and no Python."""

from __future__ import annotations

import hashlib
import io
import pathlib
import tempfile
import zipfile
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sheldrake.common._files import whole_file
from sheldrake.common._native.store import code_of_text
from sheldrake.common._native.target import Target
from sheldrake.export._c import identifier, literal, runs
from sheldrake.export._fmu_description import model_description, variables_of
from sheldrake.export._freeze import Freeze
from sheldrake.export._frozen import FrozenDiagram
from sheldrake.export._objects import require_compiler, zig
from sheldrake.export._universal import universal_library
from sheldrake.systems.framework import OutputPort

if TYPE_CHECKING:
    from os import PathLike


class Place(NamedTuple):
    """A platform, as FMI 3.0 calls it, and what is made for it.

    Attributes:
        built_as: Its name where wheels are built.
        folder2: What FMI 2.0 calls it; where that knows no such platform, its name in FMI 3.0.
        alone2: Where hosts of FMI 2.0 on such a platform look all the same; taken when the file has nothing else there.
    """

    built_as: str
    folder2: str
    alone2: str = ""


PLACES = {
    "x86_64-linux": Place("linux-x86_64", "linux64"),
    "aarch64-linux": Place("linux-aarch64", "aarch64-linux", "linux64"),
    "x86_64-windows": Place("windows-x86_64", "win64"),
    "x86_64-darwin": Place("macos-x86_64", "darwin64"),
    "aarch64-darwin": Place("macos-arm64", "darwin64"),
}
VERSIONS = ("2.0", "3.0")
_SOURCE = pathlib.Path(__file__).with_name("fmu.c")


def SaveFmu(
    diagram: Any,
    path: str | PathLike[str],
    *,
    fmi_version: str = "3.0",
    platforms: Sequence[str] = tuple(PLACES),
    name: str = "",
    outputs: Iterable[OutputPort] = (),
) -> None:
    """Writes a diagram as an FMU for co-simulation: one file, with machine code for each platform and no Python.

    Its variables are named by port and element: `plant/applied_generalized_force[3]`; states are there as
    `plant/x.` and the state's name, to be set before the first step and read at any time, and parameters may be
    set between steps. What a communication step reaches is what `Simulator.AdvanceTo` reaches: updates that are due
    just then stay pending. An instance's state can be kept, restored and given to another process. On x86-64 the file
    has kernels for two levels of processors, so that numbers are this process's to the last bit on the same processor.

    Args:
        diagram: A simulator of a diagram that `Freeze` takes, or a FrozenDiagram; the FMU begins where that stands.
        path: What is written, ending with .fmu by custom.
        fmi_version: "3.0" or "2.0".
        platforms: Some of "x86_64-linux", "aarch64-linux", "x86_64-windows", "x86_64-darwin", "aarch64-darwin".
        name: Of the model; by default the diagram's.
        outputs: Output ports beside those that the diagram exports; none with a FrozenDiagram.

    Raises:
        ValueError: something in the diagram is Python (see `Freeze`), or the version or a platform is unknown.
        ModuleNotFoundError: llvmlite or ziglang is not installed.
        OSError: the file can not be written.
    """
    if fmi_version not in VERSIONS:
        raise ValueError(f"SaveFmu(): there is no fmi_version {fmi_version!r}; there are {', '.join(VERSIONS)}.")
    wanted = [platforms] if isinstance(platforms, str) else list(platforms)
    unknown = [p for p in wanted if p not in PLACES]
    if unknown or not wanted:
        raise ValueError(f"SaveFmu(): platforms {unknown or 'are missing'}; there are {', '.join(PLACES)}.")
    require_compiler("SaveFmu()")
    if isinstance(diagram, FrozenDiagram):
        if list(outputs):
            raise ValueError(
                "SaveFmu(): outputs of a frozen diagram are named when it is frozen, Freeze(..., outputs)."
            )
        frozen = diagram
    else:
        frozen = Freeze(diagram, outputs)
    data = _Fmu(frozen, name or frozen.name or "diagram", fmi_version).packed(wanted)
    with whole_file(path) as file:
        file.write(data)


class _Fmu:
    """What goes into the file."""

    def __init__(self, frozen: FrozenDiagram, name: str, version: str):
        self.frozen, self.about, self.name, self.version = frozen, frozen.description, name, version
        self.identifier = identifier(name)
        self.words = np.frombuffer(frozen.image, np.int64)
        slab = self.about["memory"]["slab"]
        self.numbers = self.words.view(float)[slab : slab + self.about["memory"]["num_slab"]]
        self.variables = variables_of(self.about, self.numbers)
        self.digest = hashlib.sha256(frozen.ToBytes() + _SOURCE.read_bytes() + version.encode()).hexdigest()
        d = self.digest
        self.token = f"{{{d[:8]}-{d[8:12]}-{d[12:16]}-{d[16:20]}-{d[20:32]}}}"

    def packed(self, platforms: Sequence[str]) -> bytes:
        """The file; the same diagram gives the same bytes."""
        files = {"modelDescription.xml": self.description().encode()}
        files.update(self._binaries(platforms))
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
            for title, data in files.items():
                entry = zipfile.ZipInfo(title)  # its date is that of no day: the same bytes whenever it is written
                entry.external_attr = 0o644 << 16
                entry.compress_type = zipfile.ZIP_DEFLATED
                archive.writestr(entry, data)
        return out.getvalue()

    def description(self) -> str:
        """modelDescription.xml."""
        begin, periods = float(self.numbers[0]), [period for _, period in self.about.get("clocks", [])]
        return model_description(
            self.variables, self.name, self.identifier, self.token, self.version, begin, min(periods, default=None)
        )

    def _binaries(self, platforms: Sequence[str]) -> dict[str, bytes]:
        from sheldrake.common._native.build import PLATFORMS

        found: dict[str, bytes] = {}
        also: dict[str, bytes] = {}
        with tempfile.TemporaryDirectory(prefix="sheldrake-") as temporary:
            for title in dict.fromkeys(platforms):
                folder = pathlib.Path(temporary) / title
                folder.mkdir()
                target = PLATFORMS[PLACES[title].built_as]
                place = PLACES[title].folder2 if self.version == "2.0" else title
                path = f"binaries/{place}/{self.identifier}{target.ending}"
                library = self._library(target, folder)
                found[path] = universal_library([found[path], library]) if path in found else library
                if self.version == "2.0" and PLACES[title].alone2:
                    also[f"binaries/{PLACES[title].alone2}/{self.identifier}{target.ending}"] = library
        return also | found

    def _library(self, target: Any, folder: pathlib.Path) -> bytes:
        """Machine code for a platform."""
        from sheldrake.common._native.build import CPU_LEVEL
        from sheldrake.common._native.builtin import assemble

        objects = []
        for level, cpu in target.levels.items():
            machine = Target(target.triple, level, cpu)
            for f in self.about["functions"]:
                name = f"{f['symbol']}_{level}"
                objects.append(folder / f"{name}.o")
                objects[-1].write_bytes(code_of_text(f["text"], f["symbol"], f["short_loops"], machine, name))
        if len(target.levels) > 1:
            objects.append(folder / "level.o")
            objects[-1].write_bytes(assemble(CPU_LEVEL, Target(target.triple, 1, "x86-64")))
        (folder / "model.h").write_text(self._tables(list(target.levels)), encoding="ascii")
        source = folder / "fmu.c"
        source.write_bytes(_SOURCE.read_bytes())
        library = folder / f"{self.identifier}{target.ending}"
        # Products and sums of times round as in the event loop: what is due must be due here, too.
        options = ["-std=c11", "-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-sanitize=undefined", "-shared"]
        options += [] if target.ending == ".dll" else ["-lm"]
        options += [] if target.ending == ".dylib" else ["-s"]
        options += ["-Wl,-Bsymbolic"] if target.ending == ".so" else []
        zig("SaveFmu()", "cc", "-target", target.zig, *options, "-I", folder, source, *objects, "-o", library)
        return library.read_bytes()

    def _tables(self, levels: list[int]) -> str:
        """model.h."""
        about = self.about
        memory, words = about["memory"], about["words"]
        advance, outputs = about["calls"]["advance"], about["calls"]["refresh_outputs"]
        symbols = [[f"{f['symbol']}_{level}" for f in about["functions"]] for level in levels]
        pieces = runs(self.words)
        numbers = {
            "NUM_WORDS": len(self.words),
            "SLAB": memory["slab"],
            "TABLE": memory["table"],
            "NUM_FIXUPS": len(about["fixups"]),
            "NUM_ROWS": len(about["rows"]),
            "NUM_NAMES": len(about["row_names"]),
            "NUM_IMAGE": sum(2 + len(run) for _, run in pieces),
            "NUM_VARIABLES": len(self.variables),
            "NUM_CLOCKS": len(about.get("clocks", [])),
            "NUM_LOGS": len(about["logs"]),
            **{k.upper(): words[k] for k in ("status", "row", "constant", "budget", "fresh", "t_break")},
            "ADVANCE": advance["function"],
            "ADVANCE_WORDS": advance["words"],
            "ADVANCE_T": advance["words"] + advance["numbers"]["T"],
            "OUTPUTS": outputs["function"],
            "OUTPUTS_WORDS": outputs["words"],
        }
        tables = ",\n".join("{" + ", ".join(row) + "}" for row in symbols)
        logs = ", ".join(str(log["table"]) for log in about["logs"])
        clocks = ", ".join(f"{{{_hex(offset)}, {_hex(period)}}}" for offset, period in about.get("clocks", []))
        image = ",\n".join(", ".join(map(literal, (at, len(run), *run))) for at, run in pieces)
        return f"""typedef int64_t kernel(double, double *, int64_t *);
#define FMI {self.version[0]}
#define LEVELS {len(levels)}
#define TOKEN {_quoted(self.token)}
#define MODEL_HASH {literal(int(self.digest[:15], 16))}
#define BEGIN {_hex(float(self.numbers[0]))}
enum {{ {", ".join(f"{k} = {v}" for k, v in numbers.items())} }};
{"".join(f"kernel {s};{chr(10)}" for row in symbols for s in row)}int32_t sheldrake_cpu_level(void);
static kernel *const kernels[LEVELS][{len(about["functions"])}] = {{{tables}}};
static const int16_t rows[] = {{{", ".join(map(str, about["rows"]))}}};
static const char *const row_names[] = {{
{("," + chr(10)).join(map(_quoted, about["row_names"])) or '""'}}};
static const struct {{ int32_t at, to, absolute; }} fixups[] = {{
{("," + chr(10)).join(f"{{{at}, {to}, {absolute}}}" for at, to, absolute in about["fixups"]) or "{0, 0, 0}"}}};
static const int32_t logs[] = {{{logs or "0"}}};
static const struct {{ double offset, period; }} clocks[] = {{{clocks or "{0, 1}"}}};
static const struct variable {{ int32_t at; char kind; const char *name; }} variables[] = {{
{("," + chr(10)).join(f"{{{v.at}, '{v.kind}', {_quoted(v.name)}}}" for v in self.variables)}}};
static const int64_t image[] = {{
{image or "0"}}};
"""


def _hex(value: float) -> str:
    """A number in C, to the last bit."""
    return "HUGE_VAL" if value == float("inf") else float(value).hex()


def _quoted(text: str) -> str:
    """A string in C, its bytes in UTF-8."""
    plain = (chr(b) if chr(b).isalnum() or chr(b) in " _-/.:,;()[]{}" else f"\\{b:03o}" for b in text.encode())
    return '"' + "".join(c if ord(c[0]) < 128 else f"\\{ord(c):03o}" for c in plain) + '"'
