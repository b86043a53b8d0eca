"""The table of docs/other-packages.md, held to the facts."""

import pathlib

from jaxsh import harmonics

PAGE = pathlib.Path(__file__).parents[2] / "docs/other-packages.md"
OPEN = "<!-- conventions: written by tests/harmonics/test_convert_page.py -->\n"
CLOSE = "<!-- end of conventions -->"
BASES = {"4pi": "4π", "schmidt": "Schmidt"}
LAYOUTS = {
    "coefficients-last": "(…, K)",
    "channels-last": "(…, K, C)",
    "by-channel": "27, red first",
    "by-coefficient": "27",
    "cosine-sine": "(…, 2, L+1, L+1)",
}
QUANTITIES = {"radiance": "L", "irradiance": "E", "irradiance/pi": "E/π"}


def table() -> str:
    rows = ["name", "sign", "basis", "reads", "axes", "layout", "what", "degree", "of"]
    lines = [f"| {' | '.join(rows)} |", "|" + "---|" * len(rows)]
    for name, facts in harmonics.conventions().items():
        cells = [
            f"`{name}`",
            "−" if facts.phase == "condon-shortley" else "+",
            BASES.get(facts.normalization, facts.normalization),
            facts.basis_axes,
            " ".join(facts.axes).replace("-", "−"),
            LAYOUTS[facts.layout] + ("" if isinstance(facts.order, str) else ", own order"),
            QUANTITIES[facts.quantity],
            "any" if facts.degree is None else f"{facts.degree}",
            facts.about,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def test_the_table_is_that_of_the_facts():
    """`python tests/harmonics/test_convert_page.py` writes it."""
    text = PAGE.read_text("utf-8")
    assert text[text.index(OPEN) + len(OPEN) : text.index(CLOSE)] == f"\n{table()}\n"


if __name__ == "__main__":
    text = PAGE.read_text("utf-8")
    first, last = text.index(OPEN) + len(OPEN), text.index(CLOSE)
    PAGE.write_text(f"{text[:first]}\n{table()}\n{text[last:]}", "utf-8")
