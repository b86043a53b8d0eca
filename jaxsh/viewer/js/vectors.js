// Vectors of three numbers, rotations as three rows, and the matrix of a camera.

export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

export const minus = (a, b) => a.map((x, i) => x - b[i]);

export const plus = (a, b, factor = 1) => a.map((x, i) => x + factor * b[i]);

export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export const unit = (a) => a.map((x) => x / Math.hypot(...a));

export const apply = (rotation, a) => rotation.map((row) => dot(row, a));

export const multiply = (a, b) => a.map((row) => [0, 1, 2].map((j) => dot(row, b.map((r) => r[j]))));

// The rotation about an axis, counter-clockwise seen from its tip (Rodrigues).
export function about(axis, angle) {
  const [x, y, z] = unit(axis);
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const t = 1 - c;
  return [
    [c + t * x * x, t * x * y - s * z, t * x * z + s * y],
    [t * y * x + s * z, c + t * y * y, t * y * z - s * x],
    [t * z * x - s * y, t * z * y + s * x, c + t * z * z],
  ];
}

// Unit vectors to the right, upwards and forward in the picture of a camera.
export function axesOf(camera) {
  const forward = unit(minus(camera.target, camera.position));
  const right = unit(cross(forward, camera.up));
  return [right, cross(right, forward), forward];
}

// How large the picture of a camera is in a window of another shape: the tangent of half its height.
export function tangentOf(camera, aspect) {
  return Math.tan((camera.fovY * Math.PI) / 360) * Math.max(1, camera.aspect / aspect);
}

// From space to clip coordinates, by columns as WebGL wants it. The whole picture of `camera`, whose
// width is `camera.aspect` times its height, is in the middle of one of another `aspect`.
export function clipMatrix(camera, aspect, near, far) {
  const [right, up, forward] = axesOf(camera);
  const tan = tangentOf(camera, aspect);
  const depth = (far + near) / (far - near);
  const rows = [
    right.map((x) => x / (tan * aspect)),
    up.map((x) => x / tan),
    forward.map((x) => x * depth),
    forward,
  ];
  const shifts = rows.map((row) => -dot(row, camera.position));
  shifts[2] -= (2 * far * near) / (far - near);
  return [...[0, 1, 2].flatMap((j) => rows.map((row) => row[j])), ...shifts];
}

// The camera carried around its target: to the left by `across` radians and upwards by `over`, but
// not over the poles, where `up` would be along the view.
export function orbited(camera, across, over) {
  const away = minus(camera.position, camera.target);
  const [right] = axesOf(camera);
  const fromPole = Math.acos(Math.max(-1, Math.min(1, dot(unit(away), unit(camera.up)))));
  const margin = 0.02;
  const angle = fromPole - Math.max(margin, Math.min(Math.PI - margin, fromPole - over));
  const turn = multiply(about(camera.up, -across), about(right, -angle));
  return { ...camera, position: plus(camera.target, apply(turn, away)) };
}
