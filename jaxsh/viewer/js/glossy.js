// Glossy reflection towards the eye, as transfer.shade_glossy computes it: the transfer is evaluated once
// at directions that integrate a product of three functions exactly, and each change of light or camera
// sums light times transfer times lobe over them.
import { floatTexture, nearest } from "./gl.js";
import { basis } from "./harmonics.js";
import { DIFFUSE, TEXEL } from "./renderer.js";
import { shinesApart } from "./surface.js";

const GROUP = 16; // directions in a pass: four outputs of four numbers

// The transfer at a group of directions, from which a texture is made.
const SAMPLE = (scene) => `#version 300 es
precision highp float;
precision highp sampler2D;
precision highp isampler2DArray;
uniform isampler2DArray transfer;
uniform sampler2D harmonics;
uniform int first;
out vec4 some0;
out vec4 some1;
out vec4 some2;
out vec4 some3;
void main() {
  ${TEXEL(scene)}
  float sums[${GROUP}];
  for (int j = 0; j < ${GROUP}; j++) sums[j] = 0.0;
  for (int i = 0; i < ${scene.layers}; i++) {
    vec4 codes = vec4(texelFetch(transfer, ivec3(texel, i), 0));
    for (int j = 0; j < ${GROUP}; j++) {
      sums[j] += dot(codes, texelFetch(harmonics, ivec2(first + j, i), 0));
    }
  }
  some0 = vec4(sums[0], sums[1], sums[2], sums[3]);
  some1 = vec4(sums[4], sums[5], sums[6], sums[7]);
  some2 = vec4(sums[8], sums[9], sums[10], sums[11]);
  some3 = vec4(sums[12], sums[13], sums[14], sums[15]);
}`;

// Directions are in the first row of a texture, the light there times the weight in the second. The lobe
// is a polynomial of the cosine from its axis: even terms, and behind them odd ones, of t² - ½.
const SHADE_GLOSSY = (scene, groups) => {
  const terms = scene.glossy.lobes[0].length;
  const even = Math.floor((terms + 1) / 2);
  const horner = (from, to) =>
    Array.from({ length: to - from }, (_, i) => `lobe[${from + i}]`).reduceRight(
      (inner, term) => (inner ? `(${inner} * u + ${term})` : term), "");
  return `#version 300 es
precision highp float;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp isampler2DArray;
uniform isampler2DArray transfer;
uniform sampler2DArray sampled;
uniform sampler2D nodes;
uniform vec4 light[${3 * scene.layers}];
uniform float lobe[${terms}];
uniform vec3 eye;
uniform vec3 specular;
in vec3 albedo;
in vec3 position;
in vec3 normal;
out vec3 radiance;
${shinesApart(scene) ? "out vec3 shine;" : ""}
vec3 towards(vec3 v) {
  float size = length(v);
  return size > 0.0 ? v / size : v;
}
void main() {
  ${TEXEL(scene)}
  ${DIFFUSE(scene)}
  vec3 up = towards(normal);
  vec3 view = towards(eye - position);
  vec3 axis = 2.0 * dot(up, view) * up - view;
  vec3 glossy = vec3(0.0);
  for (int i = 0; i < ${4 * groups}; i++) {
    vec4 some = texelFetch(sampled, ivec3(texel, i), 0);
    for (int j = 0; j < 4; j++) {
      float t = dot(axis, texelFetch(nodes, ivec2(4 * i + j, 0), 0).xyz);
      float u = t * t - 0.5;
      float value = ${horner(0, even)}${terms > even ? ` + t * ${horner(even, terms)}` : ""};
      glossy += some[j] * value * texelFetch(nodes, ivec2(4 * i + j, 1), 0).rgb;
    }
  }
  ${shinesApart(scene)
    ? "radiance = albedo * diffuse;\n  shine = specular * glossy;"
    : "radiance = albedo * diffuse + specular * glossy;"}
}`;
};

const SAMPLED_UNIT = 2; // of textures
const NODES_UNIT = 3;

export class GlossyShading {
  constructor(renderer) {
    const { gl, scene } = renderer;
    this.renderer = renderer;
    const { nodes } = scene.glossy;
    this.groups = Math.ceil(nodes.length / GROUP);
    this.values = nodes.map((node) => Float32Array.from(basis(node, scene.degree)));
    this.#sample();
    const outputs = shinesApart(scene) ? ["radiance", "shine"] : ["radiance"];
    this.program = renderer.shading(SHADE_GLOSSY(scene, this.groups), outputs);
    this.nodes = floatTexture(gl, NODES_UNIT, GROUP * this.groups, 2);
    this.sent = new Float32Array(4 * GROUP * this.groups * 2);
    nodes.forEach((node, i) => this.sent.set(node, 4 * i));
  }

  // Evaluates the transfer at all directions.
  #sample() {
    const { gl, scene } = this.renderer;
    const width = GROUP * this.groups;
    const outputs = ["some0", "some1", "some2", "some3"];
    const made = this.renderer.shading(SAMPLE(scene), outputs);
    const table = new Float32Array(4 * width * scene.layers);
    this.values.forEach((values, i) => values.forEach((value, k) => {
      table[4 * ((k >> 2) * width + i) + (k & 3)] = value * scene.scales[k];
    }));
    const harmonics = floatTexture(gl, NODES_UNIT, width, scene.layers);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, scene.layers, gl.RGBA, gl.FLOAT, table);
    gl.activeTexture(gl.TEXTURE0 + SAMPLED_UNIT);
    this.sampled = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.sampled);
    const [rows, length] = [scene.rows, scene.rowLength];
    gl.texStorage3D(gl.TEXTURE_2D_ARRAY, 1, gl.RGBA32F, length, rows, 4 * this.groups);
    nearest(gl, gl.TEXTURE_2D_ARRAY);
    const buffers = outputs.map(() => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, buffer);
      gl.bufferData(gl.TRANSFORM_FEEDBACK_BUFFER, 16 * rows * length, gl.STREAM_COPY);
      return buffer;
    });
    gl.bindBuffer(gl.TRANSFORM_FEEDBACK_BUFFER, null);
    gl.useProgram(made);
    gl.uniform1i(gl.getUniformLocation(made, "harmonics"), NODES_UNIT);
    for (let group = 0; group < this.groups; group++) {
      gl.uniform1i(gl.getUniformLocation(made, "first"), GROUP * group);
      this.renderer.capture(buffers);
      buffers.forEach((buffer, i) => {
        gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, buffer);
        const layer = 4 * group + i;
        gl.texSubImage3D(
          gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, length, rows, 1, gl.RGBA, gl.FLOAT, 0,
        );
      });
      gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
    }
    buffers.forEach((buffer) => gl.deleteBuffer(buffer));
    gl.deleteTexture(harmonics);
    gl.deleteProgram(made);
    gl.activeTexture(gl.TEXTURE0);
  }

  // Computes every vertex's radiance of a side towards an eye.
  shade(light, eye, specular, lobe, side) {
    const { gl, scene } = this.renderer;
    const width = GROUP * this.groups;
    this.values.forEach((values, i) => {
      for (let c = 0; c < 3; c++) {
        let sum = 0;
        for (let k = 0; k < values.length; k++) sum += light[c][k] * values[k];
        this.sent[4 * (width + i) + c] = scene.glossy.weights[i] * sum;
      }
    });
    gl.activeTexture(gl.TEXTURE0 + NODES_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.nodes);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, 2, gl.RGBA, gl.FLOAT, this.sent);
    gl.activeTexture(gl.TEXTURE0);
    const at = (name) => gl.getUniformLocation(this.program, name);
    gl.useProgram(this.program);
    gl.uniform1i(at("sampled"), SAMPLED_UNIT);
    gl.uniform1i(at("nodes"), NODES_UNIT);
    gl.uniform4fv(at("light"), this.renderer.scaled(light));
    gl.uniform1fv(at("lobe"), lobe);
    gl.uniform3fv(at("eye"), eye);
    gl.uniform3fv(at("specular"), specular);
    this.renderer.run(side, true);
  }
}
