// What Python sends: a header, and arrays one after the other.
import { expanded } from "./clusters.js";

const KINDS = {
  f4: Float32Array, i1: Int8Array, i2: Int16Array, i4: Int32Array, u1: Uint8Array, u2: Uint16Array,
  u4: Uint32Array,
};

// The header, and its arrays by name over the bytes they are in; no copies. Each begins at a multiple
// of four bytes.
export function unpacked(header, bytes) {
  const scene = { ...header };
  let start = 0;
  for (const { name, type, length } of header.arrays) {
    const size = length * KINDS[type].BYTES_PER_ELEMENT;
    if (start + size <= bytes.byteLength) scene[name] = new KINDS[type](bytes, start, length);
    start += 4 * Math.ceil(size / 4);
  }
  if (start !== bytes.byteLength) {
    throw new Error(`The viewer expected ${start} bytes of data and got ${bytes.byteLength}.`);
  }
  if (header.clusters) scene.transfer = expanded(scene);
  return scene;
}

// Bytes from base64 of a gzip stream.
export async function decompressed(text) {
  const letters = atob(text.trim());
  const bytes = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

// The number of a code of 16 bits between two others, without the digits that the codes do not tell.
export function decoded(code, low, high) {
  const digits = Math.floor(-Math.log10((high - low) / 65535 || 1));
  const value = low + (code / 65535) * (high - low);
  return digits >= 0 && digits <= 100 ? Number(value.toFixed(digits)) : value;
}
