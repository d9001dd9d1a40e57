"""A section of a page between two marks, which a script writes anew and leaves the rest of the page as it is."""

import re
from pathlib import Path


def write_section(page: Path, name: str, text: str, title: str = "") -> None:
    """Put a text between the marks of a section; at the end of the page where it has none yet.

    Parameters
    ----------
    page : made where it is not there
    name : of the section, in its marks
    title : first line of a page that is made
    """
    whole = page.read_text("utf-8") if page.exists() else f"{title}\n"
    first, last = f"<!-- {name}: written by a script -->\n", f"<!-- end of {name} -->\n"
    section = f"{first}{text.strip()}\n{last}"
    marked = re.compile(re.escape(first) + ".*?" + re.escape(last), re.DOTALL)
    if marked.search(whole):
        whole = marked.sub(lambda _: section, whole)
    else:
        whole = f"{whole.rstrip()}\n\n{section}"
    page.write_text(whole, "utf-8")
