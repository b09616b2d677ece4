"""Make the tuned numbers of the joint method variable, in a copy of the kernel's sources.

A number `pub const NAME: f32 = 1.0;` of a params file becomes a function that reads the number once, when a process
first uses it: its value, multiplied by the factor in the environment variable `QUADFRINGE_TUNED`, as in
`energy::GAIN_MIN*0.5`. The names in the other files become calls. Numbers that give the length of an array stay.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from quadfringe.evaluation._scenes import ROOT

__all__ = ["FIXED", "PARAMS", "VARIABLE", "Number", "build", "make_variable", "numbers"]

JOINT = Path("crates/quadfringe/src/joint")
PARAMS = ROOT / JOINT / "params"
VARIABLE = "QUADFRINGE_TUNED"
# Lengths of arrays, which the compiler must know.
FIXED = {
    "albedo::CANDIDATES",
    "albedo::ROWS",
    "energy::SIDE",
    "local_fit::CARRIER_WINDOWS",
    "pyramid::FACTOR_MAX",
    "regions::SHIFTS",
    "uncertainty::BLOCK_CELLS",
}
SIZES_OF_TASKS = "tasks"  # params file whose numbers change the time alone
CONSTANT = re.compile(r"^(\s*)((?:pub(?:\([\w: ]+\))? )?)const ([A-Z][A-Z0-9_]*): ([^=]+?) =\s*([^;]+);", re.M)
COMMENTED = re.compile(r"((?:^///.*\n)+)^pub const ([A-Z]\w*): [^=]+? =\s*([^;]+);", re.M)
USE = re.compile(r"^\s*(?:pub(?:\([\w: ]+\))? )?use ([^;]+);", re.M)
NAME = re.compile(r"\b[A-Z][A-Z0-9_]+\b")
SCALED = """
/// What a factor makes of a number.
pub trait Scaled {
    fn scaled(self, factor: f64) -> Self;
}
impl Scaled for f32 { fn scaled(self, factor: f64) -> Self { (f64::from(self) * factor) as f32 } }
impl Scaled for f64 { fn scaled(self, factor: f64) -> Self { self * factor } }
impl Scaled for usize { fn scaled(self, factor: f64) -> Self { (self as f64 * factor).ceil() as usize } }
impl Scaled for u8 { fn scaled(self, factor: f64) -> Self { (f64::from(self) * factor).ceil() as u8 } }
impl Scaled for i16 { fn scaled(self, factor: f64) -> Self { (f64::from(self) * factor).ceil() as i16 } }
impl<T: Scaled, const N: usize> Scaled for [T; N] {
    fn scaled(self, factor: f64) -> Self { self.map(|value| value.scaled(factor)) }
}
pub fn tuned<T: Scaled>(name: &str, value: T) -> T {
    let given = std::env::var("VARIABLE").unwrap_or_default();
    match given.split_once('*') {
        Some((changed, factor)) if changed == name => value.scaled(factor.parse().expect("a factor")),
        _ => value,
    }
}
""".replace("VARIABLE", VARIABLE)


@dataclass(frozen=True)
class Number:
    """A tuned number: the stem of its params file, its name, its value in Rust, and the first sentence about it."""

    file: str
    name: str
    value: str
    meaning: str

    @property
    def key(self) -> str:
        """Its name with that of its file."""
        return f"{self.file}::{self.name}"


def numbers(params: Path) -> list[Number]:
    """List the numbers of a folder of params files that change results, in the order of the files."""
    found = []
    for file in sorted(params.glob("*.rs")):
        for comment, name, value in COMMENTED.findall(file.read_text()):
            words = " ".join(line.removeprefix("///").strip() for line in comment.splitlines())
            meaning = re.split(r"(?<=[.;:]) ", re.sub(r"\[(`\w+`)\]", r"\1", words), maxsplit=1)[0].rstrip(".;:")
            found.append(Number(file.stem, name, value, meaning))
    return [number for number in found if number.file != SIZES_OF_TASKS]


def make_variable(joint: Path) -> None:
    """Rewrite the sources of the joint method in this folder, in place."""
    params = joint / "params"
    tuned = [number for number in numbers(params) if number.key not in FIXED]
    names = {number.name for number in tuned}
    keys = {number.key for number in tuned}
    for file in params.glob("*.rs"):
        read = partial(_read, stem=file.stem, keys=keys, names=names)
        file.write_text(CONSTANT.sub(read, file.read_text()))
    (params / "mod.rs").write_text((params / "mod.rs").read_text() + SCALED)
    modules = "|".join(["params", *(file.stem for file in params.glob("*.rs"))])
    for file in joint.rglob("*.rs"):
        if params not in file.parents:
            file.write_text(_with_calls(file.read_text(), names, re.compile(rf"\b(?:{modules})::([A-Z][A-Z0-9_]+)\b")))


def build(folder: Path) -> Path:
    """Compile the kernel with variable numbers; give the folder of the package."""
    copy, package = folder / "source", folder / "package"
    ignored = shutil.ignore_patterns("target", ".git", ".venv", "generated", "__pycache__", "*.so")
    shutil.copytree(ROOT, copy, ignore=ignored)
    make_variable(copy / JOINT)
    command = "cargo build --release --package quadfringe-python --features pyo3/extension-module"
    # Functions have names of constants.
    there = os.environ | {"PYO3_PYTHON": sys.executable, "RUSTFLAGS": "--cap-lints allow"}
    subprocess.run([*command.split(), "--target-dir", folder / "target"], cwd=copy, env=there, check=True)
    shutil.copytree(copy / "python", package)
    (library,) = (file for file in (folder / "target/release").glob("*_core.*") if file.suffix in {".so", ".dylib"})
    shutil.copy(library, package / "quadfringe/_core.abi3.so")
    return package


def _read(found: re.Match[str], *, stem: str, keys: set[str], names: set[str]) -> str:
    """Give the function in place of a number of a params file."""
    _, _, name, kind, value = found.groups()
    if f"{stem}::{name}" not in keys:
        return found[0]
    value = NAME.sub(lambda word: f"{word[0]}()" if word[0] in names else word[0], value)
    lazy = f"std::sync::LazyLock<{kind}>"
    return (
        f"pub fn {name}() -> {kind} {{\n    static VALUE: {lazy} = "
        f'std::sync::LazyLock::new(|| super::tuned("{stem}::{name}", {value}));\n    *VALUE\n}}'
    )


def _with_calls(text: str, names: set[str], qualified: re.Pattern[str]) -> str:
    """Call the numbers that a file uses, and those that it derives from them."""
    here = {name for name in qualified.findall(text) if name in names}
    for use in USE.findall(text):
        # What is derived from a number in another file has its name in a `use`, too.
        here |= set(NAME.findall(use)) & (names if "params" in use else DERIVED)
    here -= {found[3] for found in CONSTANT.finditer(text)}
    derived = {found[3] for found in CONSTANT.finditer(text) if found[3] in DERIVED}
    if not here | derived:
        return text
    text = CONSTANT.sub(lambda c: f"{c[1]}{c[2]}fn {c[3]}() -> {c[4]} {{ {c[5]} }}" if c[3] in derived else c[0], text)
    called = re.compile(rf"(?<!fn )\b({'|'.join(sorted(here | derived))})\b(?!\(|::)")
    lines, in_use = [], False
    for line in text.split("\n"):
        code = line.strip()
        in_use = in_use or re.match(r"(pub(\([\w: ]+\))? )?use ", code) is not None
        lines.append(line if in_use or code.startswith("//") else called.sub(r"\1()", line))
        in_use = in_use and not code.endswith(";")
    return "\n".join(lines)


# Constants outside of params files that follow from tuned numbers.
DERIVED = {"BORDER_ODDS", "OVERLAP", "STABLE"}
