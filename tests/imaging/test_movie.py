"""Movies to files and back, read by Pillow and by ffmpeg."""

import importlib.util
import subprocess
import sys
from itertools import accumulate

import jax.numpy as jnp
import numpy as np
import pytest
from PIL import Image, ImageSequence

from jaxsh.imaging import write_movie

needs_ffmpeg = pytest.mark.skipif(
    importlib.util.find_spec("imageio_ffmpeg") is None,
    reason="imageio-ffmpeg is not installed: .mp4 is not tried",
)


def sweep(count=6, height=32, width=48):
    """A smooth picture whose hues move: float32 (count, height, width, 3) in [0, 1]."""
    x, y = np.meshgrid(np.linspace(0, 1, width), np.linspace(0, 1, height))
    phases = 2 * np.pi * np.arange(count) / count
    frames = [np.stack([x, y, 0.5 + 0.5 * np.sin(6 * x + phase)], -1) for phase in phases]
    return np.stack(frames).astype(np.float32)


def load(path):
    """Frames (n, h, w, c) in [0, 1] and the milliseconds of each."""
    with Image.open(path) as movie:
        pairs = [
            (np.asarray(frame.convert("RGB")) / 255, frame.info["duration"])
            for frame in ImageSequence.Iterator(movie)
        ]
    frames, times = zip(*pairs, strict=True)
    return np.stack(frames), list(times)


def rms(a, b):
    return np.sqrt(np.mean((a - b) ** 2))


@pytest.mark.parametrize(
    # Of 256 colors, 0.0226 measured; of 4:2:0 and quantization, 0.0129.
    ("suffix", "tolerance"),
    [(".gif", 0.025), (".webp", 0.015), (".WEBP", 0.015)],
)
def test_frames_come_back(tmp_path, suffix, tolerance):
    frames = sweep()
    path = write_movie(tmp_path / "new" / f"a{suffix}", jnp.asarray(frames), fps=20.0)
    found, times = load(path)
    assert found.shape == frames.shape
    assert rms(found, frames) < tolerance
    assert times == [50] * 6
    assert [file.name for file in path.parent.iterdir()] == [path.name]


@needs_ffmpeg
def test_mp4_comes_back(tmp_path):
    from imageio_ffmpeg import get_ffmpeg_exe

    frames = sweep(count=9)
    path = write_movie(tmp_path / "new" / "a.mp4", iter(frames), fps=12.5, quality=95.0)
    raw = ["-vf", "scale=in_color_matrix=bt709", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    run = subprocess.run([get_ffmpeg_exe(), "-i", path, *raw], capture_output=True, check=True)
    said = run.stderr.decode()
    for fact in ("h264", "yuv420p(tv, bt709/bt709/iec61966-2-1", "48x32", "12.50 fps"):
        assert fact in said
    found = np.frombuffer(run.stdout, np.uint8).reshape(-1, 32, 48, 3) / 255
    assert found.shape == frames.shape
    assert rms(found, frames) < 0.02  # 0.0174 measured
    assert [file.name for file in path.parent.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize(("suffix", "tolerance"), [(".gif", 0), (".webp", 0.02)])
def test_gray_and_codes(tmp_path, suffix, tolerance):
    gray = np.stack([np.tile(np.linspace(0, start, 40), (30, 1)) for start in (0.4, 0.7, 1.0)])
    codes = np.rint(gray * 255).astype(np.uint8)
    floats, _ = load(write_movie(tmp_path / f"a{suffix}", list(gray)))
    whole, _ = load(write_movie(tmp_path / f"b{suffix}", list(codes), encoding="srgb"))
    wide, _ = load(
        write_movie(
            tmp_path / f"c{suffix}", codes.astype(np.uint16)[..., None] * 257, encoding="srgb"
        )
    )
    np.testing.assert_array_equal(floats, whole)
    np.testing.assert_array_equal(floats, wide)
    np.testing.assert_allclose(floats[..., 0], codes / 255, rtol=0, atol=tolerance)  # 0.012


@pytest.mark.parametrize(("suffix", "unit"), [(".gif", 10), (".webp", 1)])
def test_times_add_up(tmp_path, suffix, unit):
    _, times = load(write_movie(tmp_path / f"a{suffix}", sweep(9), fps=24.0))
    ends = np.arange(1, 10) * 1000 / 24
    assert np.abs(np.array(list(accumulate(times))) - ends).max() <= unit / 2
    assert min(times) >= 40


@pytest.mark.parametrize("suffix", [".gif", ".webp"])
def test_loops_or_not(tmp_path, suffix):
    for loop in (True, False):
        with Image.open(write_movie(tmp_path / f"a{suffix}", sweep(2), loop=loop)) as movie:
            # Pillow reads of a .gif what it holds: 0 for ever, and nothing for once.
            assert (
                movie.info.get("loop") == {True: 0, False: {".gif": None, ".webp": 1}[suffix]}[loop]
            )


def test_quality_costs_bytes(tmp_path):
    sizes = [
        write_movie(tmp_path / "a.webp", sweep(), quality=quality).stat().st_size
        for quality in (20.0, 60.0, 100.0)
    ]
    assert sizes == sorted(set(sizes))


def test_a_generator_is_drawn_frame_by_frame(tmp_path, capsys):
    drawn = []

    def draw():
        for number, frame in enumerate(sweep(3)):
            drawn.append(number)
            yield frame

    frames = draw()
    write_movie(tmp_path / "a.gif", frames, progress=True)
    assert drawn == [0, 1, 2]
    assert capsys.readouterr().err == ""  # no terminal, no bar


@pytest.mark.parametrize("suffix", [".gif", ".webp", pytest.param(".mp4", marks=needs_ffmpeg)])
def test_what_fails_leaves_the_old_file(tmp_path, suffix):
    path = tmp_path / f"a{suffix}"
    path.write_bytes(b"old")
    frames = list(sweep(4))
    frames[2] = frames[2].copy()
    frames[2][0, 0] = np.nan
    with pytest.raises(ValueError, match=rf"a\{suffix}: frames\[2\]: 3 of 4608 values are NaN"):
        write_movie(path, frames)

    def breaks():
        yield from sweep(2)
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        write_movie(path, breaks())
    assert path.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(
    ("name", "frames", "options", "message"),
    [
        ("a.avi", sweep(2), {}, r"a\.avi: cannot write \.avi, only \('\.gif', '\.webp', '\.mp4'\)"),
        ("a.gif", [], {}, r"a\.gif: expected frames, got none"),
        ("a.gif", sweep(2)[0], {}, r"\(frames, height, width, channels\), got shape \(32, 48, 3\)"),
        ("a.gif", [np.ones(3)], {}, r"frames\[0\]: expected a picture .* got shape \(3,\)"),
        ("a.gif", [np.ones((4, 4, 4))], {}, r"without alpha, got shape \(4, 4, 4\)"),
        (
            "a.gif",
            [np.ones((2, 2)), np.ones((2, 3))],
            {},
            r"frames\[1\]: expected the first one's shape \(2, 2, 1\), got",
        ),
        ("a.webp", [np.ones((2, 2), np.uint8)], {}, r'frames\[0\]: integers \(uint8\) .*"srgb"'),
        ("a.webp", [np.ones((1, 16384))], {}, "at most 16383 pixels a side, got 1 × 16384"),
        ("a.webp", ["a.png"], {}, "expected image as an array of numbers, got 'a.png'"),
        ("a.gif", sweep(2), {"fps": 60}, r"fps of a \.gif must be a number >= 0\.1 and <= 50, got"),
        ("a.webp", sweep(2), {"quality": 5}, "quality must be a number >= 10 and <= 100, got 5"),
    ],
)
def test_bad_movies_are_refused(unchecked, tmp_path, name, frames, options, message):
    with pytest.raises(ValueError, match=message):
        write_movie(tmp_path / "new" / name, frames, **options)
    assert not (tmp_path / "new" / name).exists()


@needs_ffmpeg
def test_ffmpeg_takes_names_as_files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("-y.mp4", "at:10.mp4"):
        assert write_movie(name, sweep(2)).stat().st_size > 500


def test_odd_sizes_are_refused_in_mp4(tmp_path):
    with pytest.raises(ValueError, match="is of even height and width, got 3 × 4"):
        write_movie(tmp_path / "a.mp4", [np.ones((3, 4))])


def test_kinds_of_frames_are_refused(unchecked, tmp_path):
    for frames in ("a.gif", {"a": 1}, 3.0, None):
        with pytest.raises(TypeError, match="expected frames as a list, an array or a generator"):
            write_movie(tmp_path / "a.gif", frames)


def test_mp4_says_what_it_needs(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(ImportError, match=r"a\.mp4: .* the package imageio-ffmpeg.*`pip install"):
        write_movie(tmp_path / "a.mp4", sweep(2))


def test_a_folder_in_its_place(tmp_path):
    (tmp_path / "a.gif").mkdir()
    with pytest.raises(OSError, match=r"a\.gif: cannot be written: it is a folder"):
        write_movie(tmp_path / "a.gif", sweep(2))
