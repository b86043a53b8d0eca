// Where the two sides of a comparison are in a picture.

// Left, bottom, width and height of each side: beside or, in a high picture, above each other.
export function sideRectangles(width, height, compare) {
  if (!compare) return [[0, 0, width, height]];
  if (width < height) {
    const half = Math.floor(height / 2);
    return [[0, height - half, width, half], [0, 0, width, half]];
  }
  const half = Math.floor(width / 2);
  return [[0, 0, half, height], [width - half, 0, half, height]];
}
