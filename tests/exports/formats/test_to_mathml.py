"""The equations in MathML, read back, are those of LaTeX, which are the force equation; XML readers take the page."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from exported import BOATS, boat, facts, written
from tex import read_terms

from undertow.exports.formats.base import Given
from undertow.exports.formats.to_latex import term as in_latex
from undertow.exports.formats.to_mathml import EXPORT
from undertow.exports.known_facts import KnownNumber
from undertow.physics.momentum_balance import balances
from undertow.physics.presentation import MINUS

HTML, MATH = "{http://www.w3.org/1999/xhtml}", "{http://www.w3.org/1998/Math/MathML}"


def read_factor(node: ElementTree.Element) -> tuple[str, int]:
    """Name of a factor as the balance has it, and its power."""
    kind, inside = node.tag.removeprefix(MATH), list(node)
    if kind == "mi":
        return {"\N{GREEK SMALL LETTER PSI}": "psi"}.get(node.text or "", node.text or ""), 1
    if kind == "mover":
        return f"{inside[0].text}_dot", 1
    if kind == "msub":
        (stem, _), index = read_factor(inside[0]), (inside[1].text or "").replace(" ", "_")
        return f"{stem}{':' if stem == 'T' else '_'}{index}", 1
    if kind == "msup":
        return read_factor(inside[0])[0], int(inside[1].text or "")
    found = [read_factor(each)[0] for each in inside if each.tag.removeprefix(MATH) not in ("mo", "mspace")]
    return f"|{found[0]}|" if inside[0].text == "|" else " ".join(found), 1


def read_term(node: ElementTree.Element) -> tuple[float, Counter[str]]:
    """Coefficient and factors of a summand."""
    value, factors = 1.0, Counter[str]()
    for each in node:
        kind = each.tag.removeprefix(MATH)
        if kind == "mo" and each.text == MINUS:
            value = -value
        elif kind == "mn":
            value *= float(each.text or "")
        elif kind == "msup" and each[0].text == "10":
            exponent = "".join(part.text or "" for part in each[1]).replace(MINUS, "-")
            value *= 10.0 ** int(exponent)
        elif kind not in ("mo", "mspace"):
            name, power = read_factor(each)
            factors[name] += power
    return value, factors


def page(path: Path) -> ElementTree.Element:
    """The page, as a reader of XML has it."""
    return ElementTree.fromstring(path.read_text("utf-8"))


@pytest.mark.parametrize("name", BOATS)
def test_read_back_it_has_the_terms_of_latex(name: str, tmp_path: Path):
    tables = page(written(name, "mathml", tmp_path / "boat.html")).findall(f".//{MATH}mtable")
    for found, line in zip(tables, balances(boat(name)), strict=True):
        rows = [list(row) for row in found]
        left, right = list(rows[0][0][0]), [term for row in rows for term in row[2][0]]
        assert rows[0][3][0].text == ("[N m]" if line.axis == "yaw" else "[N]")
        for terms, told in ((left, line.inertia), (right, line.force)):
            expected = read_terms(" ".join(in_latex(one, k == 0) for k, one in enumerate(told)))
            assert len(terms) == len(told)
            for (value, factors), (other, same) in zip(map(read_term, terms), expected, strict=True):
                assert value == pytest.approx(other, rel=1e-14)
                assert factors == same


def test_the_table_has_a_row_for_every_number(tmp_path: Path):
    numbers = (KnownNumber("X_uu", "-8.1 N s^2/m^2", "-8.3 to -7.9", "a log <b>"), KnownNumber("yaw:u|v|", "1 N"))
    known = replace(facts("as it is"), numbers=numbers, notes=("thruster port & more",), name="A < B")
    (content,) = EXPORT.files(Given(boat("as it is"), known), tmp_path / "boat.html").values()
    root = ElementTree.fromstring(content)
    rows = [["".join(cell.itertext()) for cell in row] for row in root.findall(f".//{HTML}tbody/{HTML}tr")]
    assert rows == [
        ["Xuu", "-8.1 N s\N{SUPERSCRIPT TWO}/m\N{SUPERSCRIPT TWO}", "-8.3 to -7.9", "a log <b>"],
        ["yaw:u|v|", "1 N", "", ""],
    ]
    said = "".join(root.itertext())
    for told in (known.envelope_sentence, known.origin, "Audit: pass", "thruster port & more", "straight between"):
        assert told in said
    assert root.findtext(f".//{HTML}title") == "A < B"


def test_what_acts_within_a_factor_stands_on_the_page(tmp_path: Path):
    said = "".join(page(written("table, everything", "mathml", tmp_path / "boat.html")).itertext())
    assert "dead_zone = 0.05" in said
    assert "lag = 0.3 s" in said
    assert "relative to the water [m/s]" in said
    assert "t: time since the beginning of the log [min]" in said
