// What a surface sends out at a pixel: the radiance of its vertices, or of the texels of a picture over it,
// times the base color of its materials.
import { fill, nearest } from "./gl.js";

// Attributes beside position and radiance, and units of textures beside those of shading.
export const SURFACE_PLACES = { uv: 3, color: 4, shine: 5 };
const UNITS = { picture: 4, source: 5, radiances: 6, shines: 7 };

const placesOf = (rowLength) => (3 * rowLength) / 4;

// Levels of textures: imaging.sample_texture takes them finer by log₂ √3 than WebGL.
const FINER = -0.5 * Math.log2(3);

// Whether gloss is apart from what the base color multiplies.
export const shinesApart = ({ glossy, surface }) => Boolean(glossy && surface.tinted);

// The part of a vertex shader that hands on, by `handOn()`, what `sent()` takes in the fragment shader.
export const HAND_ON = (scene) => {
  const { texels, tinted, colored, textures } = scene.surface;
  const parts = [];
  if (!texels) parts.push("vec3 radiance seen");
  if (!texels && shinesApart(scene)) parts.push("vec3 shine shone");
  if (texels || textures.length) parts.push("vec2 uv at");
  if (tinted && colored) parts.push("vec3 color tint");
  const words = parts.map((part) => part.split(" "));
  return `
${words.map(([kind, name, handed]) => `in ${kind} ${name};\nout ${kind} ${handed};`).join("\n")}
void handOn() {
  ${words.map(([, name, handed]) => `${handed} = ${name};`).join("\n  ")}
}`;
};

// The part of a fragment shader that finds, by `sent()`, what the surface sends out; with texels also
// `pointAt()`, the number of the texel there, -1 for none.
export const SENT = (scene) => {
  const { texels, tinted, colored, textures } = scene.surface;
  const apart = shinesApart(scene);
  const lines = [`vec3 light = ${texels ? "between(radiances)" : "seen"};`];
  if (tinted) lines.push("light *= factor;");
  if (tinted && colored) lines.push("light *= tint;");
  if (textures.length) lines.push(`light *= texture(picture, vec2(at.x, 1.0 - at.y), ${FINER}).rgb;`);
  if (apart) lines.push(`light += ${texels ? "between(shines)" : "shone"};`);
  return `
precision highp sampler2D;
precision highp isampler2D;
${texels ? "" : "in vec3 seen;"}
${!texels && apart ? "in vec3 shone;" : ""}
${texels || textures.length ? "in vec2 at;" : ""}
${tinted && colored ? "in vec3 tint;" : ""}
uniform vec3 factor;
uniform sampler2D picture;
${texels ? BETWEEN(scene, texels) : ""}
vec3 sent() {
  ${lines.join("\n  ")}
  return light;
}`;
};

// Bilinear, between the texels that are known. Three numbers of each point are stored one after the other,
// four in a place, which graphics processors copy faster than three.
const BETWEEN = ({ rowLength }, { width, height }) => `
uniform isampler2D source;
uniform sampler2D radiances;
uniform sampler2D shines;
const ivec2 extent = ivec2(${width}, ${height});
int numberAt(ivec2 texel) {
  return texelFetch(source, clamp(texel, ivec2(0), extent - 1), 0).r;
}
int pointAt() {
  return numberAt(ivec2(floor(vec2(at.x, 1.0 - at.y) * vec2(extent))));
}
vec3 stored(sampler2D points, int point) {
  int first = 3 * point;
  int place = first >> 2;
  vec4 a = texelFetch(points, ivec2(place % ${placesOf(rowLength)}, place / ${placesOf(rowLength)}), 0);
  place++;
  vec4 b = texelFetch(points, ivec2(place % ${placesOf(rowLength)}, place / ${placesOf(rowLength)}), 0);
  int skipped = first & 3;
  return skipped == 0 ? a.xyz : skipped == 1 ? a.yzw : skipped == 2 ? vec3(a.zw, b.x) : vec3(a.w, b.xy);
}
vec3 between(sampler2D points) {
  vec2 place = vec2(at.x, 1.0 - at.y) * vec2(extent) - 0.5;
  ivec2 first = ivec2(floor(place));
  vec2 share = place - vec2(first);
  vec4 sum = vec4(0.0);
  for (int i = 0; i < 4; i++) {
    ivec2 corner = ivec2(i & 1, i >> 1);
    int point = numberAt(first + corner);
    if (point < 0) continue;
    vec2 weights = mix(1.0 - share, share, vec2(corner));
    sum += weights.x * weights.y * vec4(stored(points, point), 1.0);
  }
  return sum.a > 0.0 ? sum.rgb / sum.a : vec3(0.0);
}`;

export class Surface {
  constructor(gl, scene) {
    Object.assign(this, { gl, scene });
    const { surface } = scene;
    this.textures = surface.textures.map(({ wrap }, i) => this.#picture(scene.pictures[i], wrap));
    if (surface.textures.length) this.white = this.#picture(new Uint8Array([255, 255, 255, 255]));
    this.uv = this.#buffer(scene.uv);
    this.colors = this.#buffer(scene.colorCodes);
    if (surface.texels) this.#sendSource(surface.texels);
    gl.activeTexture(gl.TEXTURE0);
  }

  // What a side holds beside its radiance; its vertex array is bound.
  side(bytes) {
    const { gl, scene } = this;
    const made = {};
    if (shinesApart(scene)) {
      made.shine = gl.createBuffer();
      gl.bindBuffer(gl.ARRAY_BUFFER, made.shine);
      gl.bufferData(gl.ARRAY_BUFFER, bytes, gl.DYNAMIC_COPY);
    }
    if (scene.surface.texels) {
      made.radiances = this.#points();
      if (made.shine) made.shines = this.#points();
    } else if (made.shine) {
      this.#attribute(SURFACE_PLACES.shine, made.shine, 3, gl.FLOAT);
    }
    if (this.uv) this.#attribute(SURFACE_PLACES.uv, this.uv, 2, gl.FLOAT);
    if (this.colors) this.#attribute(SURFACE_PLACES.color, this.colors, 3, gl.UNSIGNED_SHORT);
    gl.activeTexture(gl.TEXTURE0);
    return made;
  }

  // Called when a side has been shaded; `shone` tells whether its gloss was.
  shaded(side, shone) {
    const { gl } = this;
    if (side.shine && !shone && side.shone !== false) {
      gl.bindBuffer(gl.ARRAY_BUFFER, side.shine);
      gl.bufferSubData(gl.ARRAY_BUFFER, 0, new Float32Array(this.scene.positions.length));
      gl.bindBuffer(gl.ARRAY_BUFFER, null);
    }
    if (side.radiances) this.#copy(side.radiance, side.radiances, UNITS.radiances);
    if (side.shines && (shone || side.shone !== false)) this.#copy(side.shine, side.shines, UNITS.shines);
    side.shone = shone;
  }

  // Draws by the program in use, whose vertex array is bound.
  draw(look, side) {
    const { gl, scene: { surface } } = this;
    const at = (name) => gl.getUniformLocation(look, name);
    Object.entries(UNITS).forEach(([name, unit]) => gl.uniform1i(at(name), unit));
    const bind = (unit, texture) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    };
    if (surface.texels) bind(UNITS.source, this.source);
    if (side.radiances) bind(UNITS.radiances, side.radiances);
    if (side.shines) bind(UNITS.shines, side.shines);
    surface.groups.forEach(({ first, count, factor, texture }) => {
      gl.uniform3fv(at("factor"), factor);
      if (this.white) bind(UNITS.picture, this.textures[texture] ?? this.white);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * first);
    });
    gl.activeTexture(gl.TEXTURE0);
  }

  // A texture of sRGB codes, which is looked up and halved in linear light.
  #picture(image, wrap = "repeat") {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + UNITS.picture);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const form = [gl.SRGB8_ALPHA8, gl.RGBA, gl.UNSIGNED_BYTE];
    if (image instanceof Uint8Array) gl.texImage2D(gl.TEXTURE_2D, 0, form[0], 1, 1, 0, form[1], form[2], image);
    else gl.texImage2D(gl.TEXTURE_2D, 0, ...form, image);
    gl.generateMipmap(gl.TEXTURE_2D);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
    const beyond = { repeat: gl.REPEAT, clamp: gl.CLAMP_TO_EDGE, mirror: gl.MIRRORED_REPEAT }[wrap];
    for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, beyond);
    return texture;
  }

  // The number of the texel that each place of the picture shows.
  #sendSource({ width, height }) {
    const { gl, scene } = this;
    gl.activeTexture(gl.TEXTURE0 + UNITS.source);
    this.source = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, this.source);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.R32I, width, height);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RED_INTEGER, gl.INT, scene.source);
    nearest(gl, gl.TEXTURE_2D);
  }

  // A texture for three numbers of each point, as the transfer's rows have them.
  #points() {
    const { gl, scene } = this;
    gl.activeTexture(gl.TEXTURE0 + UNITS.radiances);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, placesOf(scene.rowLength), scene.rows);
    nearest(gl, gl.TEXTURE_2D);
    return texture;
  }

  #copy(buffer, texture, unit) {
    const { gl, scene: { rowLength, rows } } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, buffer);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, placesOf(rowLength), rows, gl.RGBA, gl.FLOAT, 0);
    gl.bindBuffer(gl.PIXEL_UNPACK_BUFFER, null);
    gl.activeTexture(gl.TEXTURE0);
  }

  #buffer(values) {
    if (!values) return null;
    const buffer = this.gl.createBuffer();
    fill(this.gl, this.gl.ARRAY_BUFFER, buffer, values);
    return buffer;
  }

  #attribute(place, buffer, size, type) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, type !== gl.FLOAT, 0, 0);
  }
}
