// The mesh in false color: the luminance of what it sends out, or numbers that came with it.
import { fill, nearest, program } from "./gl.js";
import { RAMP, levelColors } from "./ramp.js";
import { DRAWN, SHOWN_COLOR } from "./renderer.js";
import { HAND_ON, SENT } from "./surface.js";

const VALUE = 2;
const CODES_UNIT = 8; // of textures
const MOST_LEVELS = 8;

// A level's weight at a vertex is 1 or 0, so that a pixel takes the level of the nearest corner and
// none in between.
const HAND_ON_VALUE = `
in float value;
out float number;
out float weights[${MOST_LEVELS}];
void handOnValue() {
  number = value;
  for (int i = 0; i < ${MOST_LEVELS}; i++) weights[i] = float(abs(value - float(i)) < 0.5);
}`;
const VALUE_OF_VERTICES = `
in float number;
in float weights[${MOST_LEVELS}];
float share() { return number; }
int level() {
  int most = 0;
  for (int i = 1; i < ${MOST_LEVELS}; i++) if (weights[i] > weights[most]) most = i;
  return most;
}`;

// A texel has its number all over.
const VALUE_OF_TEXELS = ({ rowLength }) => `
precision highp usampler2D;
uniform usampler2D codes;
uint code() {
  int point = max(pointAt(), 0);
  return texelFetch(codes, ivec2(point % ${rowLength}, point / ${rowLength}), 0).r;
}
float share() { return float(code()) / 65535.0; }
int level() { return int(code()); }`;

const PLACE_VALUE = (scene) => `#version 300 es
uniform mat4 camera;
in vec3 position;
${HAND_ON(scene)}
${scene.surface.texels ? "" : HAND_ON_VALUE}
void main() {
  handOn();
  ${scene.surface.texels ? "" : "handOnValue();"}
  gl_Position = camera * vec4(position, 1.0);
}`;

// Below the ramp, as where a light rings below zero, is gray in stripes.
const SHOW_VALUE = (scene) => `#version 300 es
precision highp float;
uniform float exposure;
uniform int kind;
uniform float over;
uniform vec3 ramp[${RAMP.length}];
uniform vec3 levels[${MOST_LEVELS}];
out vec4 shown;
${SENT(scene)}
${scene.surface.texels ? VALUE_OF_TEXELS(scene) : VALUE_OF_VERTICES}
${SHOWN_COLOR}
vec3 onRamp(float t) {
  float place = clamp(t, 0.0, 1.0) * ${RAMP.length - 1}.0;
  int i = min(int(place), ${RAMP.length - 2});
  return mix(ramp[i], ramp[i + 1], place - float(i));
}
void main() {
  vec3 color;
  vec3 seenHere = sent();
  if (kind == 0) {
    float luminance = dot(seenHere, vec3(0.2126, 0.7152, 0.0722));
    color = onRamp(exposure * luminance);
    if (luminance < 0.0) color = vec3(mod(gl_FragCoord.x + gl_FragCoord.y, 8.0) < 4.0 ? 0.45 : 0.75);
  } else if (kind == 1) {
    color = onRamp(share());
  } else {
    color = levels[level()];
  }
  shown = vec4(mix(shownColor(exposure * seenHere), color, over), 1.0);
}`;

export class FalseColor {
  constructor(renderer) {
    const { gl, scene } = renderer;
    this.renderer = renderer;
    this.program = program(gl, PLACE_VALUE(scene), SHOW_VALUE(scene), { ...DRAWN, value: VALUE });
    const stored = (codes) => (scene.surface.texels ? this.#texture(codes) : this.#buffer(codes));
    this.codes = scene.values.map(({ array }) => stored(scene[array]));
    gl.useProgram(this.program);
    gl.uniform3fv(gl.getUniformLocation(this.program, "ramp"), RAMP.flat());
  }

  // The program that draws, set to show `scene.values[index]`, or luminance where that is -1, over
  // the picture with an opacity.
  use(index, over) {
    const { gl, scene, sides } = this.renderer;
    const facts = scene.values[index];
    const set = (name) => gl.getUniformLocation(this.program, name);
    gl.useProgram(this.program);
    gl.uniform1f(set("over"), over);
    gl.uniform1i(set("codes"), CODES_UNIT);
    gl.uniform1i(set("kind"), facts ? (facts.kind === "ramp" ? 1 : 2) : 0);
    if (!facts) return this.program;
    if (facts.kind === "levels") {
      const colors = levelColors(facts.labels.length).flat();
      gl.uniform3fv(set("levels"), [...colors, ...Array(3 * MOST_LEVELS - colors.length).fill(0)]);
    }
    if (scene.surface.texels) {
      gl.activeTexture(gl.TEXTURE0 + CODES_UNIT);
      gl.bindTexture(gl.TEXTURE_2D, this.codes[index]);
      gl.activeTexture(gl.TEXTURE0);
      return this.program;
    }
    for (const { arrays } of sides) {
      gl.bindVertexArray(arrays);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.codes[index]);
      gl.enableVertexAttribArray(VALUE);
      gl.vertexAttribPointer(VALUE, 1, gl.UNSIGNED_SHORT, facts.kind === "ramp", 0, 0);
    }
    gl.bindVertexArray(null);
    return this.program;
  }

  #buffer(codes) {
    const { gl } = this.renderer;
    const buffer = gl.createBuffer();
    fill(gl, gl.ARRAY_BUFFER, buffer, codes);
    return buffer;
  }

  // A code for each texel, in the rows of the transfer.
  #texture(codes) {
    const { gl, scene: { rowLength, rows } } = this.renderer;
    gl.activeTexture(gl.TEXTURE0 + CODES_UNIT);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R16UI, rowLength, rows);
    const whole = new Uint16Array(rowLength * rows);
    whole.set(codes);
    gl.texSubImage2D(
      gl.TEXTURE_2D, 0, 0, 0, rowLength, rows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, whole,
    );
    nearest(gl, gl.TEXTURE_2D);
    gl.activeTexture(gl.TEXTURE0);
    return texture;
  }
}
