"""The equations in LaTeX, read back, are the force equation; TeX's brackets and environments are closed."""

import re
from pathlib import Path

import numpy as np
import pytest
from exported import BOATS, boat, envelope, facts, written
from matplotlib.mathtext import MathTextParser
from tex import read_terms

from undertow.exports.formats import to_latex
from undertow.exports.formats.base import Given
from undertow.exports.formats.to_latex import equation, escaped
from undertow.physics.momentum_balance import balances


@pytest.mark.parametrize("name", BOATS)
def test_read_back_it_is_the_force_equation(name: str, tmp_path: Path):
    text = written(name, "latex", tmp_path / "boat.tex").read_text("utf-8")
    blocks = re.findall(r"\\begin\{align\*\}(.*?)\\end\{align\*\}", text, re.S)
    rng = np.random.default_rng(1)
    state = dict(zip("uvr", rng.uniform(envelope(name).lower, envelope(name).upper, (1000, 3)).T, strict=True))
    for block, line in zip(blocks, balances(boat(name)), strict=True):
        body, unit = block.split("&& \\text")
        assert unit.strip() == "{[N m]}" if line.axis == "yaw" else unit.strip() == "{[N]}"
        left, right = body.split("&=")
        for side, terms in ((left, line.inertia), (right, line.force)):
            names = {factor for each in terms for factor in each.factors}
            signals = {factor: state.get(factor, rng.uniform(-1.0, 1.0, 1000)) for factor in names | {"u"}}
            expected = sum((each.value(signals) for each in terms), np.zeros(1000))
            found = np.zeros(1000)
            for value, factors in read_terms(side):
                product = np.full(1000, value)
                for factor, power in factors.items():
                    product = product * signals[factor] ** power
                found += product
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_it_says_what_the_forces_across_the_hull_are(tmp_path: Path):
    """With every number, so that a reader can work them out: twenty strips at their middles."""
    name = "table, everything"
    text = " ".join(written(name, "latex", tmp_path / "boat.tex").read_text("utf-8").split())
    told = text.partition(r"F\_Y, F\_N: half of 1025 kg/m\textasciicircum{}3 times the draught of 0.1951 m")[2]
    assert "summed over 20 strips of the length of 2 m, each of width dx, at their middles x [N, N m]" in told
    assert r"F_{Y}" in text
    plain = written("as it is", "latex", tmp_path / "plain.tex").read_text("utf-8")
    assert "strips" not in plain


@pytest.mark.parametrize("name", BOATS)
def test_a_typesetter_of_tex_takes_every_equation(name: str):
    for line in balances(boat(name)):
        inside = equation(line).partition("}")[2].rpartition("&&")[0]
        MathTextParser("path").parse("$" + re.sub(r"&|\\\\|\n", " ", inside) + "$")


@pytest.mark.parametrize("name", BOATS)
def test_every_bracket_and_environment_is_closed(name: str, tmp_path: Path):
    text = written(name, "latex", tmp_path / "boat.tex").read_text("utf-8")
    body = "\n".join(line for line in text.splitlines() if not line.startswith("%"))
    assert re.findall(r"\\begin\{([^}]*)\}", body).count("document") == 1
    opened: list[str] = []
    for kind, environment in re.findall(r"\\(begin|end)\{([^}]*)\}", body):
        if kind == "begin":
            opened.append(environment)
        else:
            assert opened.pop() == environment
    assert opened == []
    bare = re.sub(r"\\[{}]", "", body)
    assert bare.count("{") == bare.count("}")
    assert body.count("$") % 2 == 0
    assert not re.search(r"(?<!\\)#", body)


@pytest.mark.parametrize("name", BOATS)
def test_read_back_its_thrust_curves_are_the_vehicles(name: str, tmp_path: Path):
    text = written(name, "latex", tmp_path / "boat.tex").read_text("utf-8")
    rows = re.findall(r"\{(force of .*)\} \\\\", text)
    for row, thruster in zip(rows, boat(name).thrusters, strict=True):
        assert escaped(thruster.name) in row
        said = row.replace(r"\_", "_")
        if thruster.curve.kind == "table":
            pairs = re.findall(r"([-\d.e+]+) at ([-\d.e+]+)", said)
            assert [float(x) for _, x in pairs] == pytest.approx(thruster.curve.command)
            assert [float(y) for y, _ in pairs] == pytest.approx(thruster.curve.force)
        else:
            numbers = {key: float(x) for key, x in re.findall(r"(\w+) = ([-\d.e+]+)", said)}
            wanted = thruster.curve.model_dump(exclude={"kind"})
            assert {key: numbers[key] for key in wanted} == pytest.approx(wanted)


def test_what_one_thruster_has_alone_stands_beside_the_equations(tmp_path: Path):
    vehicle = boat("as it is")
    port, starboard = vehicle.thrusters
    late = vehicle.model_copy(update={"thrusters": (port, starboard.model_copy(update={"lag": 0.4}))})
    (content,) = to_latex.EXPORT.files(Given(late, facts("as it is")), tmp_path / "boat.tex").values()
    assert "Within the factors act lag = 0 s (port), 0.4 s (stbd)." in content.decode()


def test_signs_of_tex_are_escaped():
    assert escaped(r"50 % of X_u & \more {#1}") == r"50 \% of X\_u \& \textbackslash{}more \{\#1\}"
