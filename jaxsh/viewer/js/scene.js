// What Python sends: a header, and arrays one after the other.

// The arrays of a header over the bytes they are in; no copies.
export function unpacked(header, bytes) {
  const { rowLength, rows, layers, numVertices, numFaces } = header;
  const parts = [
    ["positions", Float32Array, 3 * numVertices],
    ["faces", Uint32Array, 3 * numFaces],
    ["transfer", Int16Array, 4 * rowLength * rows * layers],
  ];
  if (header.albedoPerVertex) parts.push(["albedoCodes", Uint16Array, 3 * numVertices]);
  const scene = { ...header };
  let start = 0;
  for (const [name, Kind, length] of parts) {
    scene[name] = new Kind(bytes, start, length);
    start += scene[name].byteLength;
  }
  if (start !== bytes.byteLength) {
    throw new Error(`The viewer expected ${start} bytes of data and got ${bytes.byteLength}.`);
  }
  return scene;
}

// Bytes from base64 of a gzip stream.
export async function decompressed(text) {
  const letters = atob(text.trim());
  const bytes = Uint8Array.from(letters, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}
