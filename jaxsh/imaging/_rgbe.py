"""Where the pixels of a Radiance picture end."""


def check_length(data: bytes, height: int, width: int) -> None:
    """Refuses an .hdr file that goes on after its last pixel, as one does whose height is wrong.

    Decoders stop after the rows that the header announces, whatever follows. `data` is a file that
    one has read to its end without complaint.
    """
    try:
        place = data.index(b"\n", data.index(b"\n\n") + 2) + 1  # after the header and the size
        for _ in range(height):
            place = _after_row(data, place, width)
    except (IndexError, ValueError) as error:
        raise ValueError("damaged: its header or its rows do not end where they should") from error
    if place != len(data):
        raise ValueError(f"damaged: {width} × {height} pixels end at byte {place} of {len(data)}")


def _after_row(data: bytes, place: int, width: int) -> int:
    start = data[place : place + 4]
    coded = 8 <= width <= 0x7FFF and start[:2] == b"\2\2" and start[2] < 128
    if not coded:
        return place + 4 * width
    place += 4
    for _ in range(4):  # red, green, blue and exponent, each in runs and literals
        column = 0
        while column < width:
            count = data[place]
            run = count > 128
            column += count - 128 if run else count
            place += 2 if run else count + 1
    return place
