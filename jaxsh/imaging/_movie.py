"""Writing movies to files."""

import contextlib
import functools
import itertools
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from jaxtyping import UInt8

from .._core.checks import as_path, check_flag, check_number, described
from .._core.files import check_place, put_in_place
from ._write import as_numbers, as_signal, in_8_bits

Picture = UInt8[np.ndarray, "h w c"]
Pictures = Generator[Picture, None, None]

# Frames a second: browsers slow down what is shorter than 2/100 s in a .gif, or 11 ms in a .webp.
_FASTEST = {".gif": 50.0, ".webp": 90.0, ".mp4": 240.0}
_LARGEST = {".gif": 65535, ".webp": 16383, ".mp4": 16384}
# Colors as they are, sRGB by the matrix of Rec. 709, and said to be: players guess otherwise.
_SCALE = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd"
_NAMED = "setparams=range=tv:colorspace=bt709:color_primaries=bt709:color_trc=iec61966-2-1"
_MP4 = ["-an", "-vf", f"{_SCALE},{_NAMED}", "-c:v", "libx264", "-pix_fmt", "yuv420p"]
_MP4 += ["-movflags", "+faststart", "-f", "mp4"]


def write_movie(
    path: str | os.PathLike[str],
    frames: Iterable[Any],
    *,
    fps: float = 25.0,
    loop: bool = True,
    quality: float = 80.0,
    encoding: str | None = None,
    progress: bool = True,
) -> Path:
    """Write frames as a movie: .gif and .webp by Pillow, .mp4 (H.264) by imageio-ffmpeg.

    The file is in its place once it is whole: where a frame fails, what stood there stays. Makes
    missing folders and returns the path.

    **Arguments**

    - `frames`: pictures of one size, gray (h, w) or color (h, w, 3): a list, an array (n, h, w, c),
      or a generator, from which they are taken one by one. As in `write_image`'s .png they hold
      what a screen shows (see `tone_map`), clipped to [0, 1] and rounded to 8 bits; integers, uint8
      or uint16, want `encoding="srgb"`.
    - `fps`: frames a second, at most 50 in a .gif, 90 in a .webp, 240 in an .mp4. A .gif counts in
      1/100 s: frames are longer and shorter by that, their sum is right.
    - `loop`: again and again, or once; in an .mp4 players choose.
    - `quality`: 10 to 100, of .webp and .mp4. A .gif has 256 colors a frame, found for it.
    - `progress`: counts frames on a terminal, where they take more than a second.

    A .gif is held in memory at 1 byte a pixel and a .webp at 3 until all frames have come; an
    .mp4 is not. Its colors are stored at half the width and height (4:2:0), so these are even.

    Raises `ValueError` that names the frame for NaN or infinite values, integers without an
    encoding and frames of another shape, and for no frames, extensions it does not know and options
    out of range; `OSError` where the file cannot be written, and `ImportError` for an .mp4 without
    imageio-ffmpeg (`pip install imageio-ffmpeg`, or the extra `movie`). Runs on the host.

    **Example**

    >>> import pathlib, tempfile
    >>> from jaxsh import imaging
    >>> exposures = (imaging.tone_map(imaging.studio(8, 16), 2.0**stop) for stop in range(-3, 3))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     imaging.write_movie(pathlib.Path(folder) / "studio.gif", exposures, fps=5).name
    'studio.gif'
    """
    path = as_path(path)
    suffix = path.suffix.lower()
    if suffix not in _FASTEST:
        raise ValueError(f"{path}: cannot write {suffix}, only {tuple(_FASTEST)}")
    fps = check_number(f"fps of a {suffix}", fps, least=0.1, most=_FASTEST[suffix])
    loop, progress = check_flag("loop", loop), check_flag("progress", progress)
    quality = check_number("quality", quality, least=10.0, most=100.0)
    check_place(path)
    write = functools.partial(_WRITERS[suffix], fps=fps, loop=loop, quality=quality)
    if suffix == ".mp4":
        write = functools.partial(write, ffmpeg=_ffmpeg(path))
    pictures = _pictures(path, _counted(frames, progress), encoding)
    with contextlib.closing(pictures):
        # The first one early, so that what is wrong with all of them leaves nothing behind.
        first = next(pictures, None)
        if first is None:
            raise ValueError(f"{path}: expected frames, got none")
        put_in_place({path: lambda file: write(file, itertools.chain([first], pictures))})
    return path


def _counted(frames: Any, progress: bool) -> Iterable[Any]:
    """Iterate over frames with a bar on a terminal."""
    if hasattr(frames, "ndim"):
        if frames.ndim != 4:
            raise ValueError(
                "expected frames as an array (frames, height, width, channels), got shape "
                f"{tuple(frames.shape)}; a gray picture needs a last axis of length 1"
            )
        frames = as_numbers(frames)
    elif isinstance(frames, str | bytes | dict) or not isinstance(frames, Iterable):
        raise TypeError(
            f"expected frames as a list, an array or a generator, got {described(frames)}"
        )
    if not progress:
        return frames
    from tqdm import tqdm

    # `disable=None` hides the bar when stderr is not a terminal.
    return tqdm(frames, desc="movie", unit=" frames", delay=1, file=sys.stderr, disable=None)


def _pictures(path: Path, frames: Iterable[Any], encoding: str | None) -> Pictures:
    """Check each frame and round it to 8 bits; errors name the file and the frame."""
    suffix, size = path.suffix.lower(), None
    for number, frame in enumerate(frames):
        try:
            pixels = as_numbers(frame)
            if pixels.ndim == 2:
                pixels = pixels[..., None]
            _check_shape(pixels.shape, np.shape(frame), suffix, size)
            size = pixels.shape
            pixels = in_8_bits(as_signal(pixels, encoding))
        except ValueError as error:
            raise ValueError(f"{path}: frames[{number}]: {error}") from None
        yield np.ascontiguousarray(pixels)


def _check_shape(
    shape: tuple[int, ...], given: tuple[int, ...], suffix: str, first: tuple[int, ...] | None
) -> None:
    if len(shape) != 3 or shape[2] not in (1, 3) or 0 in shape:
        raise ValueError(
            "expected a picture (height, width) or (height, width, 3), without alpha, got shape "
            f"{given}"
        )
    if first is not None and shape != first:
        raise ValueError(f"expected the first one's shape {first}, got {shape}")
    if suffix == ".mp4" and (shape[0] % 2 or shape[1] % 2):
        raise ValueError(
            f"an .mp4 picture is of even height and width, got {shape[0]} × {shape[1]}"
        )
    if max(shape) > _LARGEST[suffix]:
        raise ValueError(
            f"a {suffix} picture is of at most {_LARGEST[suffix]} pixels a side, got {shape[0]} × "
            f"{shape[1]}"
        )


def _write_gif(
    file: BinaryIO, frames: Iterable[Picture], *, fps: float, loop: bool, quality: float
) -> None:
    # A palette for each frame. A dither would make the file larger by a third, and grain of a sky.
    pictures = [_with_palette(image) for image in map(_pillow, frames)]
    _save(file, pictures, "gif", durations(len(pictures), fps, 10), **({"loop": 0} if loop else {}))


def _write_webp(
    file: BinaryIO, frames: Iterable[Picture], *, fps: float, loop: bool, quality: float
) -> None:
    pictures = [_pillow(frame) for frame in frames]
    # Each frame whole: of those that hold a changed part alone, the part's outline shows, and their
    # error is twice as large for 15 % fewer bytes. Pillow's own method, 0, makes larger files.
    times = durations(len(pictures), fps, 1)
    options = {"loop": 0 if loop else 1, "quality": quality, "method": 4, "kmin": 0, "kmax": 1}
    _save(file, pictures, "webp", times, **options)


def durations(count: int, fps: float, unit: int) -> list[int]:
    """Milliseconds of each frame, multiples of `unit`; their sums are right to half of one."""
    ends = [unit * round(number * 1000 / (fps * unit)) for number in range(count + 1)]
    return [end - start for start, end in itertools.pairwise(ends)]


def _pillow(frame: Picture):
    from PIL import Image

    return Image.fromarray(frame[..., 0] if frame.shape[2] == 1 else frame)


def _with_palette(image):
    """Reduce a picture in color to the 256 that serve it best."""
    from PIL import Image

    if image.mode == "L":
        return image
    # Until fewer pixels than this change their color: until none does takes several times as long,
    # for an error that is little smaller.
    settled = image.width * image.height // 50
    return image.quantize(256, method=Image.Quantize.MEDIANCUT, kmeans=max(settled, 1))


def _save(file: BinaryIO, pictures: list[Any], kind: str, durations: list[int], **options: Any):
    first, *rest = pictures
    first.save(file, kind, save_all=True, append_images=rest, duration=durations, **options)


def _write_mp4(
    file: BinaryIO,
    frames: Iterable[Picture],
    *,
    fps: float,
    loop: bool,
    quality: float,
    ffmpeg: str,
) -> None:
    frames = iter(frames)
    first = next(frames)
    height, width, _ = first.shape
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{fps:.6f}"]
    crf = f"{(1 - quality / 100) * 51:.1f}"
    command = [ffmpeg, "-v", "error", "-y", *source, "-i", "-", "-crf", crf, *_MP4]
    # The whole path: ffmpeg takes "-name" for an option, and "name:" for a protocol.
    command.append(os.path.abspath(file.name))
    # Its words go to a file: a pipe that nobody reads may fill up.
    with tempfile.TemporaryFile() as said:
        process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
        )
        feed = process.stdin
        assert feed is not None
        try:
            for frame in itertools.chain([first], frames):
                feed.write(np.broadcast_to(frame, (height, width, 3)).tobytes())
        except BrokenPipeError:  # it has given up, and said why
            pass
        except BaseException:
            process.kill()
            raise
        finally:
            with contextlib.suppress(BrokenPipeError):
                feed.close()
            process.wait()
        if process.returncode:
            said.seek(0)
            why = said.read().decode(errors="replace").strip().splitlines() or ["no reason given"]
            raise OSError(f"ffmpeg: {why[-1]}")


def _ffmpeg(path: Path) -> str:
    """The program that imageio-ffmpeg brings."""
    try:
        import imageio_ffmpeg

        return imageio_ffmpeg.get_ffmpeg_exe()
    except (ImportError, RuntimeError) as error:  # also where it came without its program
        raise ImportError(
            f"{path}: writing an .mp4 needs the package imageio-ffmpeg, which cannot be used here: "
            "`pip install imageio-ffmpeg`, or write a .gif or .webp"
        ) from error


_WRITERS: dict[str, Callable[..., None]] = {
    ".gif": _write_gif,
    ".webp": _write_webp,
    ".mp4": _write_mp4,
}
