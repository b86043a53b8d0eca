"""What a figure looks like."""

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg


def pixels(figure) -> np.ndarray:
    """(height, width, 3) in 0..255."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].astype(int)


def at(ax, points) -> np.ndarray:
    """The colors of the pixels that show points given in data coordinates."""
    image = pixels(ax.get_figure(root=True))
    x, y = ax.transData.transform(points).T
    return image[len(image) - 1 - y.astype(int), x.astype(int)]


def near(image, color, tolerance=40) -> np.ndarray:
    return (abs(image - np.array(color)) <= tolerance).all(axis=-1)


def hue(image, color) -> np.ndarray:
    """Pixels of the color in any shade: a balloon is lit from one side."""
    unit = image / np.maximum(np.linalg.norm(image, axis=-1, keepdims=True), 1)
    return unit @ (np.array(color) / np.linalg.norm(color)) > 0.995
