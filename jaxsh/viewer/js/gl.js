// Programs, buffers and the reading of pictures in WebGL2.

export function fill(gl, target, buffer, values) {
  gl.bindBuffer(target, buffer);
  gl.bufferData(target, values, gl.STATIC_DRAW);
}

// A linked program; `places` are the numbers of its attributes, `captured` what transform feedback takes.
export function program(gl, vertex, fragment, places, captured = []) {
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

// What `draw` draws into a picture of any size: RGBA in 8 bits, the top row first, its colors times
// their alpha. With `samples` above 1, edges are smoothed.
export function pictureOf(gl, width, height, samples, draw) {
  const frames = [gl.createFramebuffer()];
  const buffers = [];
  const attach = (place, format, count) => {
    buffers.push(gl.createRenderbuffer());
    gl.bindRenderbuffer(gl.RENDERBUFFER, buffers.at(-1));
    gl.renderbufferStorageMultisample(gl.RENDERBUFFER, count, format, width, height);
    gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffers.at(-1));
  };
  const most = samples > 1 ? Math.min(samples, gl.getParameter(gl.MAX_SAMPLES)) : 0;
  gl.bindFramebuffer(gl.FRAMEBUFFER, frames[0]);
  attach(gl.COLOR_ATTACHMENT0, gl.RGBA8, most);
  attach(gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24, most);
  draw();
  if (most) {
    frames.push(gl.createFramebuffer());
    gl.bindFramebuffer(gl.FRAMEBUFFER, frames[1]);
    attach(gl.COLOR_ATTACHMENT0, gl.RGBA8, 0);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, frames[0]);
    const whole = [0, 0, width, height];
    gl.blitFramebuffer(...whole, ...whole, gl.COLOR_BUFFER_BIT, gl.NEAREST);
    gl.bindFramebuffer(gl.FRAMEBUFFER, frames[1]);
  }
  const read = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, read);
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  frames.forEach((frame) => gl.deleteFramebuffer(frame));
  buffers.forEach((buffer) => gl.deleteRenderbuffer(buffer));
  const result = new Uint8ClampedArray(read.length);
  for (let row = 0; row < height; row++) {
    const from = 4 * width * (height - 1 - row);
    result.set(read.subarray(from, from + 4 * width), 4 * width * row);
  }
  return result;
}

// A texture of four floats in each place, bound to a unit.
export function floatTexture(gl, unit, width, height) {
  const texture = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
  nearest(gl, gl.TEXTURE_2D);
  return texture;
}

export function nearest(gl, target) {
  gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
}
