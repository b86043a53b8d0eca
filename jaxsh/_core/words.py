"""Words of others in our own errors."""


def reason(said: BaseException | str, most: int = 200) -> str:
    """Give the first line of a message, printable and of `most` characters at most.

    What a parser says of a damaged file may quote any bytes of it. An error without a message
    gives its type's name.
    """
    text = str(said).strip()
    if not text:
        return "" if isinstance(said, str) else type(said).__name__
    text = "".join(c if c.isprintable() else " " for c in text.splitlines()[0]).strip()
    return text if len(text) <= most else f"{text[: most - 3]}..."
