// Shades the vertices on the graphics processor, once per light, and draws the mesh.
import { clipMatrix, dot, minus } from "./vectors.js";

// Transfer as 16-bit integers, four coefficients in a texel, vertices along the rows of a layer.
// Their scales, 1/π and the intensity are in the light.
const SHADE = (scene) => `#version 300 es
precision highp float;
precision highp isampler2DArray;
uniform isampler2DArray transfer;
uniform vec4 light[${3 * scene.layers}];
in vec3 albedo;
out vec3 radiance;
void main() {
  ivec2 texel = ivec2(gl_VertexID % ${scene.rowLength}, gl_VertexID / ${scene.rowLength});
  vec3 sum = vec3(0.0);
  for (int i = 0; i < ${scene.layers}; i++) {
    vec4 some = vec4(texelFetch(transfer, ivec3(texel, i), 0));
    sum += vec3(dot(some, light[3 * i]), dot(some, light[3 * i + 1]), dot(some, light[3 * i + 2]));
  }
  radiance = albedo * sum;
}`;

// The second shader of a program that only shades.
const NOTHING = `#version 300 es
precision highp float;
void main() {}`;

const PLACE = `#version 300 es
uniform mat4 camera;
in vec3 position;
in vec3 radiance;
out vec3 seen;
void main() {
  seen = radiance;
  gl_Position = camera * vec4(position, 1.0);
}`;

// The steps of imaging.tone_map(…, curve="clip"): exposed, clipped, encoded as sRGB.
const SHOW = `#version 300 es
precision highp float;
uniform float exposure;
in vec3 seen;
out vec4 shown;
void main() {
  vec3 x = clamp(exposure * seen, 0.0, 1.0);
  vec3 power = 1.055 * pow(max(x, 0.0031308), vec3(1.0 / 2.4)) - 0.055;
  shown = vec4(mix(power, 12.92 * x, lessThanEqual(x, vec3(0.0031308))), 1.0);
}`;

const ALBEDO = 0;
const POSITION = 0;
const RADIANCE = 1;

export class Renderer {
  // Throws an Error, in words, where WebGL2 or memory is lacking.
  constructor(canvas, scene) {
    const options = { alpha: true, antialias: true, premultipliedAlpha: true };
    const gl = canvas.getContext("webgl2", options);
    if (!gl) throw new Error("This viewer needs WebGL2, which this browser does not offer.");
    this.gl = gl;
    this.scene = scene;
    const shade = program(gl, SHADE(scene), NOTHING, { albedo: ALBEDO }, ["radiance"]);
    const show = program(gl, PLACE, SHOW, { position: POSITION, radiance: RADIANCE });
    this.shadeProgram = shade;
    this.showProgram = show;
    this.lightAt = gl.getUniformLocation(shade, "light");
    this.cameraAt = gl.getUniformLocation(show, "camera");
    this.exposureAt = gl.getUniformLocation(show, "exposure");
    this.radiance = gl.createBuffer();
    this.#sendTransfer();
    this.#sendAlbedo();
    this.#sendMesh();
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
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) {
      gl.texParameteri(gl.TEXTURE_2D_ARRAY, filter, gl.NEAREST);
    }
  }

  #sendAlbedo() {
    const { gl, scene } = this;
    this.shadeArrays = gl.createVertexArray();
    gl.bindVertexArray(this.shadeArrays);
    if (scene.albedoCodes) {
      fill(gl, gl.ARRAY_BUFFER, gl.createBuffer(), scene.albedoCodes);
      gl.enableVertexAttribArray(ALBEDO);
      gl.vertexAttribPointer(ALBEDO, 3, gl.UNSIGNED_SHORT, true, 0, 0);
    }
  }

  #sendMesh() {
    const { gl, scene } = this;
    this.showArrays = gl.createVertexArray();
    gl.bindVertexArray(this.showArrays);
    fill(gl, gl.ARRAY_BUFFER, gl.createBuffer(), scene.positions);
    gl.enableVertexAttribArray(POSITION);
    gl.vertexAttribPointer(POSITION, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.radiance);
    gl.bufferData(gl.ARRAY_BUFFER, 4 * scene.positions.length, gl.DYNAMIC_COPY);
    gl.enableVertexAttribArray(RADIANCE);
    gl.vertexAttribPointer(RADIANCE, 3, gl.FLOAT, false, 0, 0);
    fill(gl, gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer(), scene.faces);
    gl.bindVertexArray(null);
  }

  // Computes every vertex's radiance from a light, three arrays of K coefficients.
  shade(light) {
    const { gl, scene } = this;
    const sent = new Float32Array(12 * scene.layers);
    for (let channel = 0; channel < 3; channel++) {
      for (let k = 0; k < scene.scales.length; k++) {
        const place = 12 * (k >> 2) + 4 * channel + (k & 3);
        sent[place] = (light[channel][k] * scene.scales[k] * scene.albedo[channel]) / Math.PI;
      }
    }
    gl.useProgram(this.shadeProgram);
    gl.uniform4fv(this.lightAt, sent);
    gl.bindVertexArray(this.shadeArrays);
    if (!scene.albedoCodes) gl.vertexAttrib3f(ALBEDO, 1, 1, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, this.feedback);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, this.radiance);
    gl.enable(gl.RASTERIZER_DISCARD);
    gl.beginTransformFeedback(gl.POINTS);
    gl.drawArrays(gl.POINTS, 0, scene.positions.length / 3);
    gl.endTransformFeedback();
    gl.disable(gl.RASTERIZER_DISCARD);
    gl.bindBufferBase(gl.TRANSFORM_FEEDBACK_BUFFER, 0, null);
    gl.bindTransformFeedback(gl.TRANSFORM_FEEDBACK, null);
    gl.bindVertexArray(null);
  }

  // Draws what the camera sees, on a transparent ground.
  draw(camera, exposure, width, height) {
    const { gl, scene } = this;
    const away = minus(scene.middle, camera.position);
    const distance = Math.sqrt(dot(away, away));
    const far = distance + scene.radius;
    const near = Math.max(distance - scene.radius, far / 1e4);
    gl.viewport(0, 0, width, height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.showProgram);
    gl.uniformMatrix4fv(this.cameraAt, false, clipMatrix(camera, width / height, near, far));
    gl.uniform1f(this.exposureAt, exposure);
    gl.bindVertexArray(this.showArrays);
    gl.drawElements(gl.TRIANGLES, scene.faces.length, gl.UNSIGNED_INT, 0);
    gl.bindVertexArray(null);
  }

  // Linear radiance of the vertices, as `shade` left it: three numbers each.
  colors() {
    const { gl } = this;
    const colors = new Float32Array(this.scene.positions.length);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.radiance);
    gl.getBufferSubData(gl.ARRAY_BUFFER, 0, colors);
    gl.bindBuffer(gl.ARRAY_BUFFER, null);
    return colors;
  }

  // A picture of any size, one sample in a pixel: RGBA in 8 bits, the top row first.
  pixels(camera, exposure, width, height) {
    const { gl } = this;
    const frame = gl.createFramebuffer();
    const buffers = [gl.createRenderbuffer(), gl.createRenderbuffer()];
    const formats = [gl.RGBA8, gl.DEPTH_COMPONENT24];
    const places = [gl.COLOR_ATTACHMENT0, gl.DEPTH_ATTACHMENT];
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    buffers.forEach((buffer, i) => {
      gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, formats[i], width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, places[i], gl.RENDERBUFFER, buffer);
    });
    this.draw(camera, exposure, width, height);
    const read = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, read);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    gl.deleteFramebuffer(frame);
    buffers.forEach((buffer) => gl.deleteRenderbuffer(buffer));
    const rows = [];
    for (let row = height - 1; row >= 0; row--) {
      rows.push(read.subarray(4 * width * row, 4 * width * (row + 1)));
    }
    const result = new Uint8ClampedArray(read.length);
    rows.forEach((row, i) => result.set(row, 4 * width * i));
    return result;
  }

  // Gives the graphics memory back: a page may hold few contexts.
  release() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

function fill(gl, target, buffer, values) {
  gl.bindBuffer(target, buffer);
  gl.bufferData(target, values, gl.STATIC_DRAW);
}

function program(gl, vertex, fragment, places, captured = []) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  for (const [name, place] of Object.entries(places)) gl.bindAttribLocation(made, place, name);
  if (captured.length) gl.transformFeedbackVaryings(made, captured, gl.SEPARATE_ATTRIBS);
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS) && !gl.isContextLost()) {
    throw new Error(`A shader did not compile: ${gl.getProgramInfoLog(made)}`);
  }
  return made;
}
