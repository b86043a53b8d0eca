// A vertex's transfer as a balloon on it: in each direction as far as the transfer is large there,
// orange where it is positive and blue where it is negative.
import { fill, program } from "./gl.js";
import { basis } from "./harmonics.js";
import { transferOf } from "./picking.js";
import { cross, minus, plus } from "./vectors.js";

const [RINGS, SPOKES] = [64, 128];
const LARGEST = 0.35; // the largest radius beside the mesh's
const COLORS = { positive: [0.902, 0.497, 0.1], negative: [0.169, 0.435, 0.741] };
const [PLACE_AT, SIGN_AT, NORMAL_AT] = [0, 1, 2];

const PLACE_LOBE = `#version 300 es
uniform mat4 camera;
in vec3 position;
in float amount;
in vec3 normal;
out vec3 at;
out vec3 across;
out float strength;
void main() {
  at = position;
  across = normal;
  strength = amount;
  gl_Position = camera * vec4(position, 1.0);
  gl_PointSize = 9.0;
}`;

// Lit from the eye. Colors are times their opacity.
const SHOW_LOBE = `#version 300 es
precision highp float;
uniform vec3 eye;
uniform float opacity;
uniform bool marker;
in vec3 at;
in vec3 across;
in float strength;
out vec4 shown;
void main() {
  float cosine = dot(across, eye - at) / max(length(across) * length(eye - at), 1e-30);
  float facing = marker ? 1.0 : 0.35 + 0.65 * abs(cosine);
  vec3 color = strength >= 0.0 ? vec3(${COLORS.positive}) : vec3(${COLORS.negative});
  if (marker && distance(gl_PointCoord, vec2(0.5)) > 0.5) discard;
  if (marker) color = vec3(0.08);
  shown = vec4(color * facing, 1.0) * opacity;
}`;

// Directions of a grid over the sphere, and the triangles between them.
export function sphereGrid(rings, spokes) {
  const [directions, faces] = [[], []];
  for (let i = 0; i <= rings; i++) {
    for (let j = 0; j <= spokes; j++) {
      const [theta, phi] = [(Math.PI * i) / rings, (2 * Math.PI * j) / spokes];
      const s = Math.sin(theta);
      directions.push([s * Math.cos(phi), s * Math.sin(phi), Math.cos(theta)]);
      const at = i * (spokes + 1) + j;
      if (i < rings && j < spokes) faces.push(at, at + spokes + 1, at + 1, at + 1, at + spokes + 1, at + spokes + 2);
    }
  }
  return { directions, faces };
}

export class Lobe {
  constructor(renderer) {
    const { gl, scene } = renderer;
    this.renderer = renderer;
    this.grid = sphereGrid(RINGS, SPOKES);
    this.values = this.grid.directions.map((way) => basis(way, scene.degree));
    const places = { position: PLACE_AT, amount: SIGN_AT, normal: NORMAL_AT };
    this.program = program(gl, PLACE_LOBE, SHOW_LOBE, places);
    this.buffers = [[PLACE_AT, 3], [SIGN_AT, 1], [NORMAL_AT, 3]].map(([place, size]) => {
      return { place, size, buffer: gl.createBuffer() };
    });
    this.arrays = gl.createVertexArray();
    gl.bindVertexArray(this.arrays);
    fill(gl, gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer(), new Uint32Array(this.grid.faces));
    this.buffers.forEach(({ place, size, buffer }) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 0, 0);
    });
    gl.bindVertexArray(null);
    this.shapes = new Map();
  }

  // The transfer of a vertex, cut at a degree, in the grid's directions.
  amountsOf(vertex, degree) {
    const coefficients = transferOf(this.renderer.scene, vertex).slice(0, (degree + 1) ** 2);
    return Float32Array.from(this.values, (values) =>
      coefficients.reduce((sum, x, k) => sum + x * values[k], 0));
  }

  // Points, amounts and normals of the balloon, and behind them the vertex itself.
  #shape(vertex, degree) {
    const key = `${vertex} ${degree}`;
    if (this.shapes.has(key)) return this.shapes.get(key);
    const { positions, radius } = this.renderer.scene;
    const amounts = this.amountsOf(vertex, degree);
    const largest = amounts.reduce((most, x) => Math.max(most, Math.abs(x)), 1e-30);
    const scale = (LARGEST * radius) / largest;
    const middle = [0, 1, 2].map((i) => positions[3 * vertex + i]);
    const points = this.grid.directions.map((way, n) => plus(middle, way, scale * Math.abs(amounts[n])));
    const shape = [
      Float32Array.from([...points, middle].flat()),
      Float32Array.from([...amounts, 0]),
      Float32Array.from([...points.map((_, n) => this.#normal(points, n)), middle].flat()),
    ];
    if (this.shapes.size > 1) this.shapes.clear();
    this.shapes.set(key, shape);
    return shape;
  }

  #normal(points, n) {
    const [ring, spoke] = [Math.floor(n / (SPOKES + 1)), n % (SPOKES + 1)];
    if (ring === 0 || ring === RINGS) return this.grid.directions[n];
    const at = (i, j) => points[i * (SPOKES + 1) + ((j + SPOKES) % SPOKES)];
    const down = minus(at(ring + 1, spoke), at(ring - 1, spoke));
    return cross(down, minus(at(ring, spoke + 1), at(ring, spoke - 1)));
  }

  // Draws into a rectangle: what the mesh hides shines through it.
  draw(vertex, degree, camera, rectangle) {
    const { gl } = this.renderer;
    const shape = this.#shape(vertex, degree);
    this.buffers.forEach(({ buffer }, i) => fill(gl, gl.ARRAY_BUFFER, buffer, shape[i]));
    const at = (name) => gl.getUniformLocation(this.program, name);
    gl.viewport(...rectangle);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(at("camera"), false, this.renderer.matrix(camera, rectangle));
    gl.uniform3fv(at("eye"), camera.position);
    gl.bindVertexArray(this.arrays);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    const pass = (depth, opacity, draws) => {
      gl.depthFunc(depth);
      gl.uniform1f(at("opacity"), opacity);
      draws();
    };
    const balloon = () =>
      gl.drawElements(gl.TRIANGLES, this.grid.faces.length, gl.UNSIGNED_INT, 0);
    gl.uniform1i(at("marker"), 0);
    gl.depthMask(false);
    pass(gl.GREATER, 0.2, balloon);
    gl.depthMask(true);
    pass(gl.LESS, 1, balloon);
    gl.uniform1i(at("marker"), 1);
    pass(gl.ALWAYS, 1, () => gl.drawArrays(gl.POINTS, shape[1].length - 1, 1));
    gl.depthFunc(gl.LESS);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
  }
}
