// Shades the vertices on the graphics processor, once per light, and draws the mesh.
import { fill, nearest, program } from "./gl.js";
import { HAND_ON, SENT, SURFACE_PLACES, Surface, shinesApart } from "./surface.js";
import { clipMatrix, dot, minus } from "./vectors.js";

// Transfer as 16-bit integers, four coefficients in a texel, vertices along the rows of a layer: the
// steps of shaders that find a vertex's `texel`, and sum up what is `diffuse`. Scales, 1/π and the
// intensity are in the light.
export const TEXEL = ({ rowLength }) =>
  `ivec2 texel = ivec2(gl_VertexID % ${rowLength}, gl_VertexID / ${rowLength});`;
export const DIFFUSE = ({ layers }) => `
  vec3 diffuse = vec3(0.0);
  for (int i = 0; i < ${layers}; i++) {
    vec4 some = vec4(texelFetch(transfer, ivec3(texel, i), 0));
    diffuse += vec3(dot(some, light[3 * i]), dot(some, light[3 * i + 1]), dot(some, light[3 * i + 2]));
  }`;

const SHADE = (scene) => `#version 300 es
precision highp float;
precision highp isampler2DArray;
uniform isampler2DArray transfer;
uniform vec4 light[${3 * scene.layers}];
in vec3 albedo;
out vec3 radiance;
void main() {
  ${TEXEL(scene)}
  ${DIFFUSE(scene)}
  radiance = albedo * diffuse;
}`;

// The second shader of a program that only shades.
const NOTHING = `#version 300 es
precision highp float;
void main() {}`;

const PLACE = (scene) => `#version 300 es
uniform mat4 camera;
in vec3 position;
${HAND_ON(scene)}
void main() {
  handOn();
  gl_Position = camera * vec4(position, 1.0);
}`;

// The steps of imaging.tone_map(…, curve="clip") after exposure: clipped, encoded as sRGB.
export const SHOWN_COLOR = `
vec3 shownColor(vec3 linear) {
  vec3 x = clamp(linear, 0.0, 1.0);
  vec3 power = 1.055 * pow(max(x, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  return mix(power, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}`;

const SHOW = (scene) => `#version 300 es
precision highp float;
uniform float exposure;
out vec4 shown;
${SENT(scene)}
${SHOWN_COLOR}
void main() {
  shown = vec4(shownColor(exposure * sent()), 1.0);
}`;

// Attributes of shading, and of drawing.
const SHADED = { albedo: 0, position: 1, normal: 2 };
export const DRAWN = { position: 0, radiance: 1, ...SURFACE_PLACES };

export class Renderer {
  // Throws an Error, in words, where WebGL2 or memory is lacking.
  constructor(canvas, scene) {
    const options = { alpha: true, antialias: true, premultipliedAlpha: true };
    const gl = canvas.getContext("webgl2", options);
    if (!gl) throw new Error("This viewer needs WebGL2, which this browser does not offer.");
    this.gl = gl;
    this.scene = scene;
    const shade = this.shading(SHADE(scene));
    const show = program(gl, PLACE(scene), SHOW(scene), DRAWN);
    this.shadeProgram = shade;
    this.showProgram = show;
    this.lightAt = gl.getUniformLocation(shade, "light");
    this.#sendTransfer();
    this.#sendMesh();
    this.#sendShaded();
    this.feedback = gl.createTransformFeedback();
    const error = gl.getError();
    if (error) throw new Error(`The graphics processor did not take the mesh (WebGL ${error}).`);
  }

  #sendTransfer() {
    const { gl, scene } = this;
    const [width, height, depth] = [scene.rowLength, scene.rows, scene.layers];
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, gl.createTexture());
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA16I, width, height, depth);
    const [format, type] = [gl.RGBA_INTEGER, gl.SHORT];
    gl.texSubImage3D(
      gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, width, height, depth, format, type, scene.transfer,
    );
    nearest(gl, gl.TEXTURE_2D_ARRAY);
  }

  // Two sides, A and B, have the mesh in common; each has radiance of its own. Of texels, points that
  // are not the mesh's vertices, there is room for whole rows.
  #sendMesh() {
    const { gl, scene } = this;
    const [positions, faces] = [gl.createBuffer(), gl.createBuffer()];
    const { texels } = scene.surface;
    const bytes = texels ? 12 * scene.rows * scene.rowLength : 4 * scene.positions.length;
    this.positions = positions;
    this.surface = new Surface(gl, scene);
    fill(gl, gl.ARRAY_BUFFER, positions, scene.vertices ?? scene.positions);
    fill(gl, gl.ELEMENT_ARRAY_BUFFER, faces, scene.faces);
    this.sides = [0, 1].map(() => {
      const side = { arrays: gl.createVertexArray(), radiance: gl.createBuffer() };
      gl.bindVertexArray(side.arrays);
      gl.bindBuffer(gl.ARRAY_BUFFER, positions);
      gl.enableVertexAttribArray(DRAWN.position);
      gl.vertexAttribPointer(DRAWN.position, 3, gl.FLOAT, false, 0, 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, side.radiance);
      gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.DYNAMIC_COPY);
      if (!texels) {
        gl.enableVertexAttribArray(DRAWN.radiance);
        gl.vertexAttribPointer(DRAWN.radiance, 3, gl.FLOAT, false, 0, 0);
      }
      Object.assign(side, this.surface.side(bytes));
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, faces);
      gl.bindVertexArray(null);
      return side;
    });
  }

  // What shading programs take of each vertex.
  #sendShaded() {
    const { gl, scene } = this;
    this.shadeArrays = gl.createVertexArray();
    gl.bindVertexArray(this.shadeArrays);
    if (scene.albedoCodes) {
      fill(gl, gl.ARRAY_BUFFER, gl.createBuffer(), scene.albedoCodes);
      gl.enableVertexAttribArray(SHADED.albedo);
      gl.vertexAttribPointer(SHADED.albedo, 3, gl.UNSIGNED_SHORT, true, 0, 0);
    }
    gl.bindBuffer(gl.ARRAY_BUFFER, this.positions);
    if (scene.vertices) fill(gl, gl.ARRAY_BUFFER, gl.createBuffer(), scene.positions);
    gl.enableVertexAttribArray(SHADED.position);
    gl.vertexAttribPointer(SHADED.position, 3, gl.FLOAT, false, 0, 0);
    if (scene.normals) {
      fill(gl, gl.ARRAY_BUFFER, gl.createBuffer(), scene.normals);
      gl.enableVertexAttribArray(SHADED.normal);
      gl.vertexAttribPointer(SHADED.normal, 3, gl.FLOAT, false, 0, 0);
    }
    gl.bindVertexArray(null);
  }

  // Computes every vertex's radiance of a side from a light, three arrays of K coefficients.
  shade(light, side = 0) {
    const { gl } = this;
    gl.useProgram(this.shadeProgram);
    gl.uniform4fv(this.lightAt, this.scaled(light));
    this.run(side);
  }

  // The light as shading programs take it, times all that the codes of the transfer lack.
  scaled(light) {
    const { scene } = this;
    const sent = new Float32Array(12 * scene.layers);
    for (let channel = 0; channel < 3; channel++) {
      for (let k = 0; k < scene.scales.length; k++) {
        const place = 12 * (k >> 2) + 4 * channel + (k & 3);
        sent[place] = (light[channel][k] * scene.scales[k] * scene.albedo[channel]) / Math.PI;
      }
    }
    return sent;
  }

  // A program that shades: from `position`, `normal` and `albedo` of a vertex it makes the `radiance`,
  // or other outputs.
  shading(source, outputs = ["radiance"]) {
    return program(this.gl, source, NOTHING, SHADED, outputs);
  }

  // Runs the shading program in use for the vertices of a side; one of gloss makes `shine` as well where
  // that is apart.
  run(side, glossy = false) {
    const { radiance, shine } = this.sides[side];
    const shines = glossy && shinesApart(this.scene);
    this.capture(shines ? [radiance, shine] : [radiance]);
    this.surface.shaded(this.sides[side], shines);
  }

  // The same, each output into a buffer.
  capture(buffers) {
    const { gl, scene } = this;
    gl.bindVertexArray(this.shadeArrays);
    if (!scene.albedoCodes) gl.vertexAttrib3f(SHADED.albedo, 1, 1, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.feedback);
    buffers.forEach((buffer, i) => gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, i, buffer));
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, scene.positions.length / 3);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    buffers.forEach((_, i) => gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, i, null));
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
    gl.bindVertexArray(null);
  }

  // Makes a picture of this size transparent and empty.
  clear(width, height) {
    const { gl } = this;
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
  }

  // Draws what the camera sees of a side into a rectangle of the picture, given by its left and
  // bottom, its width and height. Without `look`, a program that takes the same attributes and
  // uniforms, in its colors.
  draw(camera, exposure, rectangle, side = 0, look = this.showProgram) {
    const { gl } = this;
    gl.viewport(...rectangle);
    gl.useProgram(look);
    gl.uniformMatrix4fv(gl.getUniformLocation(look, "camera"), false, this.matrix(camera, rectangle));
    gl.uniform1f(gl.getUniformLocation(look, "exposure"), exposure);
    gl.bindVertexArray(this.sides[side].arrays);
    this.surface.draw(look, this.sides[side]);
    gl.bindVertexArray(null);
  }

  // From space to clip coordinates, by columns; also holds what stands out of the mesh a little.
  matrix(camera, [, , width, height]) {
    const { middle } = this.scene;
    const radius = 1.6 * this.scene.radius;
    const away = minus(middle, camera.position);
    const distance = Math.sqrt(dot(away, away));
    const far = distance + radius;
    const near = Math.max(distance - radius, far / 1e4);
    return clipMatrix(camera, width / height, near, far);
  }

  // Linear radiance of a side's vertices from `first` on, as `shade` left it: three numbers each.
  colors(side = 0, first = 0, count = this.scene.positions.length / 3) {
    const { gl } = this;
    const colors = new Float32Array(3 * count);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.sides[side].radiance);
    gl.getBufferSubData(gl.ARRAY_BUFFER, 12 * first, colors);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    return colors;
  }

  // Gives the graphics memory back: a page may hold few contexts.
  release() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}
