"""Markdown tables and their cells."""

NOTHING = "–"


def length(metres: float) -> str:
    """Length in a suitable unit; below a nanometre as a power of ten."""
    size = abs(metres)
    if size < 1e-9:
        return "0" if size == 0 else f"{metres:.0e} m"
    for unit, scale in (("m", 1.0), ("cm", 1e-2), ("mm", 1e-3), ("µm", 1e-6)):
        if size >= scale:
            return f"{metres / scale:.3g} {unit}"
    return f"{metres / 1e-9:.3g} nm"


def table(heads: list[str], rows: list[list[str]]) -> str:
    """Markdown table with an empty first head."""
    lines = [["", *heads], ["---"] * (len(heads) + 1), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
