"""Equations in LaTeX, read back."""

import re
from collections import Counter

NUMBER = re.compile(r"([\d.]+)(?: \\cdot 10\^\{(-?\d+)\})?(?: \\, )?")


def read_factor(text: str) -> tuple[str, int]:
    """Name of a factor as the balance has it, and its power."""
    whole = re.fullmatch(r"(.*?)(?:\^\{(\d)\})?", text)
    assert whole is not None
    name = re.sub(r"\\dot\{(\w)\}", r"\1_dot", whole[1])
    name = re.sub(r"T_\{\\mathrm\{(.*)\}\}", lambda m: "T:" + m[1].replace("\\_", "_"), name)
    name = re.sub(r"\\left\|~(.*)~\\right\|", r"|\1|", name).replace("\\cos~\\", "cos ").replace("\\sin~\\", "sin ")
    return re.sub(r"(\w)_\{(\w+)\}", r"\1_\2", name), int(whole[2] or 1)


def read_terms(text: str) -> list[tuple[float, Counter]]:
    """Coefficient and factors of each summand of one side."""
    found = []
    flat = " ".join(re.sub(r"\\\\\s*&\\quad", " ", text).split())
    for piece in re.split(r" (?=[+-] )", flat):
        sign = -1.0 if piece.startswith("-") else 1.0
        rest = piece.lstrip("+- ")
        size = NUMBER.match(rest)
        value = sign * (float(f"{size[1]}e{size[2] or 0}") if size else 1.0)
        product = rest[size.end() :] if size else rest
        joined = re.sub(r"\\left\| (.*?) \\right\|", r"\\left|~\1~\\right|", product).replace(r"s \psi", r"s~\psi")
        joined = joined.replace(r"n \psi", r"n~\psi")
        factors: Counter[str] = Counter()
        for each in joined.split():
            name, power = read_factor(each)
            factors[name] += power
        found.append((value, factors))
    return found
