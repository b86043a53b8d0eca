// Which vertex is under a place of the picture, and what its transfer is.
import { axesOf, cross, dot, minus, plus, tangentOf } from "./vectors.js";

// The ray of a camera through a place, given from -1 to 1 to the right and upwards.
export function rayAt(camera, [x, y], aspect) {
  const [right, up, forward] = axesOf(camera);
  const tangent = tangentOf(camera, aspect);
  const direction = plus(plus(forward, right, x * tangent * aspect), up, y * tangent);
  return { origin: camera.position, direction };
}

// The vertex nearest to where a ray first meets the mesh, or null. All faces are tried, by Möller &
// Trumbore 1997.
export function vertexAt({ positions, faces }, { origin, direction }) {
  const point = (vertex) => [0, 1, 2].map((i) => positions[3 * vertex + i]);
  let [best, found] = [Infinity, null];
  for (let face = 0; face < faces.length; face += 3) {
    const a = point(faces[face]);
    const [ab, ac] = [minus(point(faces[face + 1]), a), minus(point(faces[face + 2]), a)];
    const across = cross(direction, ac);
    const determinant = dot(ab, across);
    if (determinant === 0) continue;
    const from = minus(origin, a);
    const u = dot(from, across) / determinant;
    if (u < 0 || u > 1) continue;
    const over = cross(from, ab);
    const v = dot(direction, over) / determinant;
    const distance = dot(ac, over) / determinant;
    if (v < 0 || u + v > 1 || distance <= 0 || distance >= best) continue;
    best = distance;
    const weights = [1 - u - v, u, v];
    found = faces[face + weights.indexOf(Math.max(...weights))];
  }
  return found;
}

// The K coefficients of a vertex's transfer.
export function transferOf({ transfer, scales, rows, rowLength }, vertex) {
  return Float64Array.from(scales, (scale, k) => {
    const texel = (k >> 2) * rows * rowLength + vertex;
    return scale * transfer[4 * texel + (k & 3)];
  });
}
