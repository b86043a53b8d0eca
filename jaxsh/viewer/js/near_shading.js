// Shades each vertex by the light of a lamp near it, on the graphics processor.
import { floatTexture } from "./gl.js";
import { TEXEL } from "./renderer.js";

// The grid's trilinear weights, and half of the gradient of each of the eight samples around a vertex
// (midrange.interpolate, rule "half"). Scales and factors are in the texture: across, four terms of each
// sample, and downwards layers of four coefficients, channel after channel.
const SHADE_NEAR = (scene, channels) => `#version 300 es
precision highp float;
precision highp sampler2D;
precision highp isampler2DArray;
uniform isampler2DArray transfer;
uniform sampler2D terms;
uniform vec3 lower;
uniform vec3 spacing;
uniform vec3 color;
in vec3 albedo;
in vec3 position;
out vec3 radiance;
const ivec3 shape = ivec3(${scene.near.grid.shape});
void main() {
  ${TEXEL(scene)}
  vec3 place = (position - lower) / spacing;
  ivec3 cell = clamp(ivec3(floor(place)), ivec3(0), shape - 2);
  vec3 share = place - vec3(cell);
  int start[8];
  vec4 factors[8];
  for (int j = 0; j < 8; j++) {
    ivec3 side = ivec3(j >> 2, (j >> 1) & 1, j & 1);
    ivec3 at = cell + side;
    vec3 weights = mix(vec3(1.0) - share, share, vec3(side));
    float weight = weights.x * weights.y * weights.z;
    start[j] = 4 * ((at.x * shape.y + at.y) * shape.z + at.z);
    factors[j] = weight * vec4(1.0, 0.5 * spacing * (share - vec3(side)));
  }
  vec3 sum = vec3(0.0);
  for (int i = 0; i < ${scene.layers}; i++) {
    vec4 some = vec4(texelFetch(transfer, ivec3(texel, i), 0));
    for (int c = 0; c < ${channels}; c++) {
      vec4 light = vec4(0.0);
      for (int j = 0; j < 8; j++) {
        for (int m = 0; m < 4; m++) {
          ivec2 at = ivec2(start[j] + m, ${scene.layers} * c + i);
          light += factors[j][m] * texelFetch(terms, at, 0);
        }
      }
      sum[c] += dot(some, light);
    }
  }
  radiance = albedo * color * ${channels === 1 ? "sum.x" : "sum"};
}`;

const TERMS_UNIT = 1; // of textures; the transfer has the first

export class NearShading {
  constructor(renderer) {
    const { gl, scene } = renderer;
    this.renderer = renderer;
    this.channels = scene.nearTerms ? 3 : 1;
    this.program = renderer.shading(SHADE_NEAR(scene, this.channels));
    const [x, y, z] = scene.near.grid.shape;
    this.size = [4 * x * y * z, this.channels * scene.layers];
    this.terms = floatTexture(gl, TERMS_UNIT, ...this.size);
    gl.activeTexture(gl.TEXTURE0);
  }

  // Computes every vertex's radiance of a side from the light at the samples, as `lampTerms` gives it,
  // times a factor for each coefficient.
  shade({ channels, terms, moved, color }, factors, side) {
    const { gl, scene } = this.renderer;
    const [width, height] = this.size;
    const scaled = factors.map((factor, k) => (factor * scene.scales[k]) / Math.PI);
    const sent = new Float32Array(4 * width * height);
    for (let i = 0, place = 0; i < width; i++) {
      for (let c = 0; c < channels; c++) {
        for (let k = 0; k < scaled.length; k++) {
          const row = c * scene.layers + (k >> 2);
          sent[4 * (row * width + i) + (k & 3)] = scaled[k] * terms[place++];
        }
      }
    }
    gl.activeTexture(gl.TEXTURE0 + TERMS_UNIT);
    gl.bindTexture(gl.TEXTURE_2D, this.terms);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, sent);
    gl.activeTexture(gl.TEXTURE0);
    const { lower, upper, shape } = scene.near.grid;
    const at = (name) => gl.getUniformLocation(this.program, name);
    gl.useProgram(this.program);
    gl.uniform1i(at("terms"), TERMS_UNIT);
    gl.uniform3fv(at("lower"), lower.map((x, axis) => x + moved[axis]));
    gl.uniform3fv(at("spacing"), shape.map((n, axis) => (upper[axis] - lower[axis]) / (n - 1)));
    gl.uniform3fv(at("color"), color.map((x, channel) => x * scene.albedo[channel]));
    this.renderer.run(side);
  }
}
