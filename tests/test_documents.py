"""The documents: links lead somewhere, commands exist (those quoted in the code too), decision records are complete.

Figures that docs/method/approximations.md and the README take from the table of docs/figures.md equal those of it.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DECISIONS = ROOT / "docs" / "decisions"
RECORDS = sorted(path for path in DECISIONS.glob("*.md") if path.name != "README.md")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *ROOT.glob("crates/*/README.md")])
SOURCES = sorted(
    path
    for folder in ("crates", "python", "evaluation", "benches", "tests")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".rs", ".py"} and path != Path(__file__) and "target" not in path.parts
)
PARTS = ("Context", "Decision", "Alternatives considered", "Consequence", "Command")
LINES_MAX = 30
FILE = re.compile(r"(?<!\S)((?:evaluation|benches|tests|scripts|docs)/[\w./-]+|[\w-]+/[\w./-]+\.(?:py|rs))")
FOLDERS = (ROOT, ROOT / "python" / "quadfringe", ROOT / "crates" / "quadfringe" / "src")
MAKEFILE = (ROOT / "Makefile").read_text()

# Turns of phrase that CONTRIBUTING rules out: plain words say the same.
AVOIDED = re.compile(r"\b(?:(?:its|their|your) own|beside|as far as|(?:is|are) told|asked of)\b", re.IGNORECASE)

APPROXIMATIONS = (ROOT / "docs" / "method" / "approximations.md").read_text()
README = (ROOT / "README.md").read_text()
ALL_FIGURES = (ROOT / "docs" / "figures.md").read_text()
README_LINES_MAX, README_FIGURES = 150, 10
# A figure of the page, as {} in its words, and its row of the table of docs/figures.md. "A > B" is the first row B
# after the row A. "below {}" is a limit; words without {} state that the figure is 0.
FIGURES = (
    ("{} % of full scale of stray light", "gamma 2.2, crosstalk 15 % each way: stray light left, % of full scale"),
    ("levels within {} % RMS", "the same: RMS of the levels, % of full scale"),
    ("fringes of 20 px: {} rad RMS", "raw mosaic, fringes of 20 px: phase RMS, rad"),
    ("(bilinear {})", "raw mosaic, fringes of 20 px: phase RMS, rad > the same mosaic interpolated by OpenCV, rad"),
    ("of 10 px: {} rad", "raw mosaic, fringes of 10 px: phase RMS, rad"),
    ("(bilinear {} rad)", "raw mosaic, fringes of 10 px: phase RMS, rad > the same mosaic interpolated by OpenCV, rad"),
    ("coloured shades, 3 % noise: {} rad RMS", "the same with coloured shades, rad"),
    ("against {} rad on white", "peaks, 3 % noise, white: phase RMS, rad"),
    ("random colours, 3 % noise: {} rad RMS", "the same with shades and sharp random colours, rad"),
    ("median {} rad", "the same with shades and sharp random colours, rad > the same, median, rad"),
    ("{} degrees about x", "allowable deviation of the infrared projector, rx, deg"),
    ("{} degrees about y", "allowable deviation of the infrared projector, ry, deg"),
    ("{} degrees about z", "allowable deviation of the infrared projector, rz, deg"),
    ("{} mm along x", "allowable deviation of the infrared projector, tx, mm"),
    ("{} mm along z", "allowable deviation of the infrared projector, tz, mm"),
    ("{} mm and more along the fringes", "allowable deviation of the infrared projector, ty, mm"),
    (
        "up to {} rad, no wrong order",
        "pre-deformed image, 700 to 900 mm: infrared against expectation, worst, rad",
    ),
    ("no wrong order;", "pre-deformed image, 1 degree and 0.5 mm apart: wrong orders, worst, %"),
    ("as few as {} % of the pixels", "pre-deformed image, 1 degree and 5 mm apart: returned, least, %"),
    ("up to {} % wrong orders", "pre-deformed image, 1 degree and 5 mm apart: wrong orders, worst, %"),
    ("{} rad RMS on a plane", "plane without noise: phase RMS a fringe away from edges, rad"),
    ("{} rad on peaks", "peaks without noise: phase RMS a fringe away from edges, rad"),
    ("{} rad on steps", "steps without noise: phase RMS a fringe away from edges, rad"),
    *(
        ("no wrong order on these surfaces", f"{surface} without noise: wrong orders among returned pixels, pixels")
        for surface in ("plane", "peaks", "steps")
    ),
    ("a face with 3 % noise has {} rad RMS", "face, 3 % noise, all colours: phase RMS, rad"),
    ("peaks {} rad", "peaks, 3 % noise, white: phase RMS, rad"),
    ("{} % wrong orders among returned", "steps: wrong fringe orders among returned pixels, %"),
    ("{} % among those of a face", "face: wrong fringe orders among returned pixels, %"),
    ("{} % of the lit pixels of steps", "steps: lit pixels returned, %"),
    ("{} % of a face returned", "face: lit pixels returned, %"),
    ("traditional {} rad RMS", "peaks, 3 % noise: traditional FTP, full field, rad"),
    ("improved {} rad,", "improved FTP, full field, rad"),
    ("joint {} rad", "proposed, full field, rad"),
    ("worst focal length {} %", "worst focal length, %"),
    ("worst principal point {} px", "worst principal point, px"),
    *(
        ("reprojection below {} px", row)
        for row in (
            "mean reprojection error, camera, px",
            "the same, visible projector, px (published 0.269)",
            "the same, infrared projector, px (published 0.221)",
        )
    ),
)
CONDITIONS = (
    r"gamma 2\.2 and crosstalk of 15 %",
    "3 % noise",
    "noise of 3 %",
    "fringes of 20 px",
    "of 10 px",
    r"1 degree and (0\.5|5) mm apart",
    "700 to 900 mm",
)


def name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def commands(text: str) -> list[str]:
    """Give the code spans and the lines of shell blocks."""
    blocks = re.findall(r"^```(?:sh|console)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    spans = re.findall(r"`([^`]+)`", re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL))
    return [" ".join(span.split()) for span in spans] + [line for block in blocks for line in block.splitlines()]


def quoted(text: str) -> list[str]:
    """Give the commands in code spans of a source; a span may continue on the next line of a comment."""
    joined = re.sub(r"\n[ \t]*(?://[/!]?|#)?[ \t]*", " ", text)
    return [" ".join(span.split()) for span in re.findall(r"`((?:cargo|make|pytest|python) [^`]+)`", joined)]


def missing(command: str) -> list[str]:
    """Give the files and targets that a command names and the repository does not have."""
    files = FILE.findall(command)
    targets = re.findall(r"--test (\w+)", command) if command.startswith("cargo test") else []
    lost = [t for t in targets if not [*ROOT.glob(f"crates/*/tests/{t}.rs"), *ROOT.glob(f"crates/*/tests/{t}/main.rs")]]
    if made := re.match(r"make ([\w-]+)", command):
        lost += [] if re.search(rf"^{made[1]}:", MAKEFILE, re.MULTILINE) else [made[1]]
    return lost + [file for file in files if not any((folder / file).exists() for folder in FOLDERS)]


def table(text: str) -> list[tuple[str, str, str]]:
    """Give figure, value and command of the rows of a table of figures."""
    rows = text.partition("<!-- figures -->")[2].partition("<!-- /figures -->")[0].splitlines()
    return [
        (c[0], c[1], c[3].strip("`"))
        for row in rows
        if len(c := row.strip("| ").split(" | ")) == 4 and "---" not in row
    ]


def measured(rows: list[tuple[str, str, str]], figure: str) -> float:
    """Give the value of a row, named as in `FIGURES`."""
    start = 0
    for part in figure.split(" > "):
        start = next(i for i, row in enumerate(rows) if i >= start and row[0] == part)
    return float(rows[start][1])


def stated_wrongly(page: str, figures: str) -> list[str]:
    """Name the figures of the page that differ from the table, by more than the rounding of the page."""
    rows, faults = table(figures), []
    for words, figure in FIGURES:
        found = re.search(re.escape(words).replace(r"\{\}", r"(\d+(?:\.\d+)?)"), page)
        if found is None:
            faults.append(f"the page does not say {words!r}")
            continue
        value, stated = measured(rows, figure), found[1] if "{}" in words else "0"
        half_a_unit = 0.501 * 10.0 ** -len(stated.partition(".")[2])
        right = value < float(stated) if "below {}" in words else abs(value - float(stated)) <= half_a_unit
        if not (right and ("{}" in words or value == 0)):
            faults.append(f"{figure}: {value}, the page says {found[0]!r}")
    return faults


def untied(page: str, figures: str) -> list[str]:
    """Give the costs with a number that is not in `FIGURES` or `CONDITIONS`, in rows with a command of the table."""
    commands_of_figures, faults = {command for _, _, command in table(figures)}, []
    for line in page.splitlines():
        cells = line.strip("| ").split(" | ")
        if len(cells) != 4 or not commands_of_figures & set(re.findall(r"`([^`]+)`", cells[3])):
            continue
        rest = re.sub(r"\[[^\]]*\]\([^)]*\)", "", cells[2])
        for words, _ in FIGURES:
            rest = re.sub(re.escape(words).replace(r"\{\}", r"\d+(?:\.\d+)?"), "", rest)
        if re.search(r"\d", re.sub("|".join(CONDITIONS), "", rest)):
            faults.append(cells[2])
    return faults


def test_the_page_of_approximations_has_the_figures_of_the_table() -> None:
    assert stated_wrongly(APPROXIMATIONS, ALL_FIGURES) == []
    assert untied(APPROXIMATIONS, ALL_FIGURES) == []


def test_a_figure_that_parts_from_the_table_is_found() -> None:
    assert len(stated_wrongly(APPROXIMATIONS.replace("0.068 rad", "0.069 rad"), ALL_FIGURES)) == 1
    assert len(stated_wrongly(APPROXIMATIONS, ALL_FIGURES.replace("| 0.06799 |", "| 0.06899 |"))) == 1
    assert len(stated_wrongly(APPROXIMATIONS, ALL_FIGURES.replace("| 0.004284 |", "| 0.005284 |"))) == 1
    assert len(stated_wrongly(APPROXIMATIONS.replace("traditional 0.068", "the first 0.068"), ALL_FIGURES)) == 1
    assert len(untied(APPROXIMATIONS.replace("99.9 % of a face", "99.9 % of a face, 98 % of peaks"), ALL_FIGURES)) == 1


def test_the_readme_is_short_and_has_ten_figures_of_the_table() -> None:
    assert len(README.splitlines()) <= README_LINES_MAX
    chosen = {(value, command) for _, value, command in table(README)[1:]}
    assert len(table(README)) == README_FIGURES + 1  # with the head
    assert chosen <= {(value, command) for _, value, command in table(ALL_FIGURES)}


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_links_lead_to_files(document: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", document.read_text(), flags=re.MULTILINE | re.DOTALL)
    targets = re.findall(r"\]\((?!https?:|#)([^)#\s]+)(?:#[^)]*)?\)", text)
    assert [target for target in targets if not (document.parent / target).exists()] == []


@pytest.mark.parametrize("document", [path for path in DOCUMENTS if path.name != "CHANGELOG.md"], ids=name)
def test_commands_exist(document: Path) -> None:
    lost = {command: gone for command in commands(document.read_text()) if (gone := missing(command))}
    assert lost == {}


def test_commands_in_the_sources_exist() -> None:
    cited = [(name(source), command) for source in SOURCES for command in quoted(source.read_text())]
    assert len(cited) > 30
    assert [(source, command, gone) for source, command in cited if (gone := missing(command))] == []


@pytest.mark.parametrize("record", RECORDS, ids=name)
def test_a_record_is_complete_and_short(record: Path) -> None:
    text = record.read_text()
    assert re.match(rf"# {record.name[:4]}: \S.*\n\nDate: 2\d{{3}}-\d\d-\d\d\. Status: (accepted|replaced)", text)
    assert re.findall(r"^\*\*([\w ]+)\.\*\*", text, re.MULTILINE) == list(PARTS)
    assert len(text.splitlines()) <= LINES_MAX


def test_the_list_of_records_is_whole() -> None:
    rows = []
    for number, record in enumerate(RECORDS, 1):
        head = re.match(r"# (\d{4}): (.+)\n\nDate: (\S+)\.", record.read_text())
        assert head is not None
        assert head[1] == record.name[:4] == f"{number:04d}"
        rows.append(f"| [{head[1]}]({record.name}) | {head[3]} | {head[2]} |")
    lines = (DECISIONS / "README.md").read_text().splitlines()
    assert [line for line in lines if line.startswith("| [")] == rows


@pytest.mark.parametrize("document", DOCUMENTS, ids=name)
def test_a_document_avoids_words_that_puzzle(document: Path) -> None:
    assert AVOIDED.findall(" ".join(document.read_text().split())) == []


def test_sources_avoid_words_that_puzzle() -> None:
    folders = ("python", "crates", "evaluation", "benches", "tests")
    paths = [path for folder in folders for end in ("py", "pyi", "rs") for path in (ROOT / folder).rglob(f"*.{end}")]
    found = {name(path): AVOIDED.findall(path.read_text()) for path in paths if path.name != Path(__file__).name}
    assert len(found) > 400
    assert {path: words for path, words in found.items() if words} == {}


def test_names_in_the_glossary_exist() -> None:
    sources = [*(ROOT / "python").rglob("*.py"), *ROOT.glob("crates/*/src/**/*.rs"), ROOT / "pyproject.toml"]
    known = set(re.findall(r"\w+", "\n".join(path.read_text() for path in sources)))
    spans = re.findall(r"`([^`]+)`", (ROOT / "docs" / "glossary.md").read_text())
    names = {word for span in spans for word in re.findall(r"[A-Za-z]\w+", span) if not word.isupper()}
    assert len(names) > 80
    assert names - known == set()


def test_what_is_missing_is_found() -> None:
    assert missing("python evaluation/nothing.py --seeds 3") == ["evaluation/nothing.py"]
    assert missing("cargo test --test nothing") == ["nothing"]
    assert missing("make nothing") == ["nothing"]
    assert missing("devices/nothing.py") == ["devices/nothing.py"]
    assert quoted("//! `python\n//! evaluation/nothing.py`") == ["python evaluation/nothing.py"]
    assert missing("make demo") == missing("pytest tests/test_documents.py") == []
