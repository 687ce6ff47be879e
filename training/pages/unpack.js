// Reads what `packing.py` has packed.

async function inflate(text) {
  const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

const INTEGERS = { bool: Uint8Array, uint8: Uint8Array, uint16: Uint16Array, uint32: Uint32Array };

// {name: typed array}: integers as they are, everything else as floats.
async function unpack(packed) {
  const buffer = await inflate(packed.data);
  const arrays = {};
  let offset = 0;
  for (const [name, type, length, low, step] of packed.fields) {
    const integers = new INTEGERS[type](buffer, offset, length);
    offset += integers.byteLength;
    arrays[name] = step === 0 ? integers : Float32Array.from(integers, (n) => (n === 65535 ? NaN : low + step * n));
  }
  return arrays;
}
