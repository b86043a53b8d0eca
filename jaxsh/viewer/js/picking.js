// Which vertex is under a place of the picture, and what its transfer is.
import { axesOf, cross, dot, minus, plus, tangentOf } from "./vectors.js";

// The ray of a camera through a place, given from -1 to 1 to the right and upwards.
export function rayAt(camera, [x, y], aspect) {
  const [right, up, forward] = axesOf(camera);
  const tangent = tangentOf(camera, aspect);
  const direction = plus(plus(forward, right, x * tangent * aspect), up, y * tangent);
  return { origin: camera.position, direction };
}

// The point of the transfer nearest to where a ray first meets the mesh, or null: a vertex, or a texel.
export function pointUnder(scene, ray) {
  const hit = hitOf(scene, ray);
  if (!hit) return null;
  const { corners, weights } = hit;
  const { texels } = scene.surface;
  if (!texels) return corners[weights.indexOf(Math.max(...weights))];
  const [u, v] = [0, 1].map((i) => weights.reduce((sum, x, k) => sum + x * scene.uv[2 * corners[k] + i], 0));
  const inside = (x, count) => Math.min(count - 1, Math.max(0, Math.floor(x * count)));
  const texel = scene.source[inside(1 - v, texels.height) * texels.width + inside(u, texels.width)];
  return texel < 0 ? null : texel;
}

// The corners of the face that a ray first meets, and their weights; null where it meets none. All faces
// are tried, by Möller & Trumbore 1997.
function hitOf({ positions, vertices = positions, faces }, { origin, direction }) {
  const point = (vertex) => [0, 1, 2].map((i) => vertices[3 * vertex + i]);
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
    found = { corners: faces.slice(face, face + 3), weights: [1 - u - v, u, v] };
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
