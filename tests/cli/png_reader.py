"""PNG files as pilesim writes them, as numbers."""

import zlib


def read_png(path):
    """Width, height and rows of numbers (of lists of three, where it is in colour)."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    chunks, at = {}, 8
    while at < len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + length]
        crc = int.from_bytes(data[at + 8 + length : at + 12 + length], "big")
        assert crc == zlib.crc32(kind + body)
        chunks[kind] = chunks.get(kind, b"") + body
        at += 12 + length
    width, height = (int.from_bytes(chunks[b"IHDR"][i : i + 4], "big") for i in (0, 4))
    bits, colour = chunks[b"IHDR"][8], chunks[b"IHDR"][9]
    channels, size = {0: 1, 2: 3}[colour], bits // 8
    raw, rows = zlib.decompress(chunks[b"IDAT"]), []
    stride = width * channels * size
    for row in range(height):
        line = bytearray(raw[row * (stride + 1) + 1 : (row + 1) * (stride + 1)])
        assert raw[row * (stride + 1)] == 1  # differences to the left
        for i in range(channels * size, stride):
            line[i] = (line[i] + line[i - channels * size]) & 0xFF
        values = [int.from_bytes(line[i : i + size], "big") for i in range(0, stride, size)]
        rows.append(values if channels == 1 else [values[i : i + 3] for i in range(0, len(values), 3)])
    return width, height, rows
