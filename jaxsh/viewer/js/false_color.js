// The mesh in false color: the luminance of what it sends out, or numbers that came with it.
import { fill, program } from "./gl.js";
import { RAMP, levelColors } from "./ramp.js";
import { POSITION, RADIANCE, SHOWN_COLOR } from "./renderer.js";

const VALUE = 2;
const MOST_LEVELS = 8;

// A level's weight at a vertex is 1 or 0, so that a pixel takes the level of the nearest corner and
// none in between.
const PLACE_VALUE = `#version 300 es
uniform mat4 camera;
in vec3 position;
in vec3 radiance;
in float value;
out vec3 seen;
out float number;
out float weights[${MOST_LEVELS}];
void main() {
  seen = radiance;
  number = value;
  for (int i = 0; i < ${MOST_LEVELS}; i++) weights[i] = float(abs(value - float(i)) < 0.5);
  gl_Position = camera * vec4(position, 1.0);
}`;

// Below the ramp, as where a light rings below zero, is gray in stripes.
const SHOW_VALUE = `#version 300 es
precision highp float;
uniform float exposure;
uniform int kind;
uniform float over;
uniform vec3 ramp[${RAMP.length}];
uniform vec3 levels[${MOST_LEVELS}];
in vec3 seen;
in float number;
in float weights[${MOST_LEVELS}];
out vec4 shown;
${SHOWN_COLOR}
vec3 onRamp(float t) {
  float place = clamp(t, 0.0, 1.0) * ${RAMP.length - 1}.0;
  int i = min(int(place), ${RAMP.length - 2});
  return mix(ramp[i], ramp[i + 1], place - float(i));
}
void main() {
  vec3 color;
  if (kind == 0) {
    float luminance = dot(seen, vec3(0.2126, 0.7152, 0.0722));
    color = onRamp(exposure * luminance);
    if (luminance < 0.0) color = vec3(mod(gl_FragCoord.x + gl_FragCoord.y, 8.0) < 4.0 ? 0.45 : 0.75);
  } else if (kind == 1) {
    color = onRamp(number);
  } else {
    int most = 0;
    for (int i = 1; i < ${MOST_LEVELS}; i++) if (weights[i] > weights[most]) most = i;
    color = levels[most];
  }
  shown = vec4(mix(shownColor(exposure * seen), color, over), 1.0);
}`;

export class FalseColor {
  constructor(renderer) {
    const { gl, scene } = renderer;
    this.renderer = renderer;
    const places = { position: POSITION, radiance: RADIANCE, value: VALUE };
    this.program = program(gl, PLACE_VALUE, SHOW_VALUE, places);
    this.buffers = scene.values.map(({ array }) => {
      const buffer = gl.createBuffer();
      fill(gl, gl.ARRAY_BUFFER, buffer, scene[array]);
      return buffer;
    });
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
    gl.uniform1i(set("kind"), facts ? (facts.kind === "ramp" ? 1 : 2) : 0);
    if (!facts) return this.program;
    if (facts.kind === "levels") {
      const colors = levelColors(facts.labels.length).flat();
      gl.uniform3fv(set("levels"), [...colors, ...Array(3 * MOST_LEVELS - colors.length).fill(0)]);
    }
    for (const { arrays } of sides) {
      gl.bindVertexArray(arrays);
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[index]);
      gl.enableVertexAttribArray(VALUE);
      gl.vertexAttribPointer(VALUE, 1, gl.UNSIGNED_SHORT, facts.kind === "ramp", 0, 0);
    }
    gl.bindVertexArray(null);
    return this.program;
  }
}
