"""A DEFLATE encoder for filtered images: Huffman codes of each image, matches for runs of zeros.

Filtered spectra have almost no repeated strings, so searching for them costs time and saves
nothing; only the entropy coder remains. It uses only integer arithmetic, so equal images give equal
bytes on every machine and with any library version. Any zlib reads the result.
"""

import struct

import deflate
import numpy as np

from lowalt.machine.jit import PLAIN
from lowalt.tiles.huffman_code import LONGEST, canonical_codes, code_lengths

END = 256
SYMBOLS = 286
WORD = 8
# A shorter run of zeros is cheaper as literals, each of which costs about a bit where zeros are
# that common.
RUN_WORDS = 3
U64 = np.uint64


def _lengths_of_matches() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Symbol, extra bits and their number for match lengths 0 .. 258 (RFC 1951, section 3.2.5)."""
    symbol = np.zeros(259, np.int64)
    extra = np.zeros(259, np.int64)
    bits = np.zeros(259, np.int64)
    length = 3
    for code in range(257, 285):
        width = max(0, (code - 261) // 4)
        for rest in range(1 << width):
            if length < 258:
                symbol[length] = code
                extra[length] = rest
                bits[length] = width
                length += 1
    symbol[258] = 285
    return symbol, extra, bits


MATCH_SYMBOL, MATCH_EXTRA, MATCH_BITS = _lengths_of_matches()
CODE_ORDER = np.array([16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15])


@PLAIN
def _zero_words(words, start):
    """Number of zero words in a row from `start`."""
    end = start
    while end < words.size and words[end] == 0:
        end += 1
    return end - start


@PLAIN
def _count(data, words):
    """How often each symbol occurs, (286,)."""
    # Four tables, since equal neighbours would wait for each other's count.
    tables = np.zeros((4, SYMBOLS), np.int64)
    at = 0
    while at < words.size:
        if words[at] == 0:
            run = _zero_words(words, at)
            if run >= RUN_WORDS:
                tables[0, 0] += 1
                left = run * WORD - 1
                while left >= 3:
                    step = min(left, 258)
                    tables[0, MATCH_SYMBOL[step]] += 1
                    left -= step
                tables[0, 0] += left
                at += run
                continue
        first = at * WORD
        for k in range(0, WORD, 4):
            tables[0, data[first + k]] += 1
            tables[1, data[first + k + 1]] += 1
            tables[2, data[first + k + 2]] += 1
            tables[3, data[first + k + 3]] += 1
        at += 1
    for byte in range(words.size * WORD, data.size):
        tables[0, data[byte]] += 1
    tables[0, END] += 1
    for symbol in range(SYMBOLS):
        tables[0, symbol] += tables[1, symbol] + tables[2, symbol] + tables[3, symbol]
    return tables[0]


@PLAIN
def _put(out, state, code, length):
    """Append `length` bits, at most 60, without a branch.

    state: word being filled, bits in it, its number.
    """
    word = state[0]
    bits = state[1]
    out[state[2]] = word | code << bits
    ends = (bits + length) >> U64(6)
    # Shifted in two steps, since a shift by 64 is undefined.
    carry = (code >> U64(1)) >> (U64(63) - bits)
    state[0] = carry if ends else word | code << bits
    state[1] = (bits + length) & U64(63)
    state[2] += ends


@PLAIN
def _put_words(data, table, first, last, out, state):
    """Append the codes of the bytes of words first .. last - 1.

    Four bytes are appended at a time, which have at most 60 bits.
    """
    low = U64(0x7FFF)
    shift = U64(16)
    six = U64(6)
    one = U64(1)
    full = U64(63)
    word = state[0]
    bits = state[1]
    number = state[2]
    for start in range(first * WORD, last * WORD, 4):
        a = table[data[start]]
        b = table[data[start + 1]]
        c = table[data[start + 2]]
        d = table[data[start + 3]]
        ab = (a & low) | (b & low) << (a >> shift)
        cd = (c & low) | (d & low) << (c >> shift)
        length = (a >> shift) + (b >> shift)
        code = ab | cd << length
        length += (c >> shift) + (d >> shift)
        filled = word | code << bits
        out[number] = filled
        ends = (bits + length) >> six
        word = (code >> one) >> (full - bits) if ends else filled
        bits = (bits + length) & full
        number += ends
    state[0] = word
    state[1] = bits
    state[2] = number


@PLAIN
def _put_symbol(out, state, table, symbol):
    """Append the code of one symbol."""
    _put(out, state, table[symbol] & U64(0x7FFF), table[symbol] >> U64(16))


@PLAIN
def _put_run(out, state, table, run):
    """Append `run` words of zeros.

    They are one literal, then matches at distance 1 and what is left of them.
    """
    _put_symbol(out, state, table, np.int64(0))
    left = run * WORD - 1
    while left >= 3:
        step = min(left, 258)
        _put_symbol(out, state, table, MATCH_SYMBOL[step])
        # The one distance code, for distance 1, is a single zero bit after the length's extra bits.
        _put(out, state, U64(MATCH_EXTRA[step]), U64(MATCH_BITS[step] + 1))
        left -= step
    for _ in range(left):
        _put_symbol(out, state, table, np.int64(0))


@PLAIN
def _table(counts, longest):
    """Code and length of every symbol in one number: code | length << 16."""
    lengths = code_lengths(counts, longest)
    codes = canonical_codes(lengths)
    for symbol in range(codes.size):
        codes[symbol] |= U64(lengths[symbol]) << U64(16)
    return codes


@PLAIN
def _encode(data, words, counts, order, out):
    """Write one final block with its own Huffman code to `out` (uint64); return its bytes."""
    table = _table(counts, np.int64(LONGEST))
    # The one distance code comes last, one bit long.
    lengths = np.ones(SYMBOLS + 1, np.int64)
    header = np.zeros(19, np.int64)
    header[1] = 1
    for symbol in range(SYMBOLS):
        lengths[symbol] = table[symbol] >> U64(16)
        header[lengths[symbol]] += 1
    header_table = _table(header, np.int64(7))
    state = np.zeros(3, np.uint64)
    # Final block, dynamic code, 286 literal and length codes, one distance code, 19 lengths of the
    # header's code.
    for value, width in ((1, 1), (2, 2), (SYMBOLS - 257, 5), (0, 5), (15, 4)):
        _put(out, state, U64(value), U64(width))
    for symbol in order:
        _put(out, state, header_table[symbol] >> U64(16), U64(3))
    for length in lengths:
        _put_symbol(out, state, header_table, length)
    # Typed numbers, because numba would compile the function again for a plain 0.
    at = np.int64(0)
    pending = np.int64(0)
    while at < words.size:
        if words[at] == 0:
            run = _zero_words(words, at)
            if run >= RUN_WORDS:
                _put_words(data, table, pending, at, out, state)
                _put_run(out, state, table, run)
                at += run
                pending = at
                continue
        at += 1
    _put_words(data, table, pending, at, out, state)
    for byte in range(words.size * WORD, data.size):
        _put_symbol(out, state, table, np.int64(data[byte]))
    _put_symbol(out, state, table, np.int64(END))
    out[state[2]] = state[0]
    return state[2] * U64(8) + (state[1] + U64(7)) // U64(8)


def zlib_compress(data: np.ndarray) -> bytes:
    """Return `data`, a contiguous uint8 array, as a zlib stream.

    Source: RFC 1950 and RFC 1951 (dynamic Huffman codes).
    """
    data = np.ascontiguousarray(data).reshape(-1)
    words = data[: data.size - data.size % WORD].view(np.uint64)
    # No symbol is longer than 15 bits; the header has fewer than 512 bytes.
    out = np.empty(data.size * 2 // WORD + 128, np.uint64)
    size = _encode(data, words, _count(data, words), CODE_ORDER, out)
    stream = out.astype("<u8", copy=False).view(np.uint8)[: int(size)].tobytes()
    return b"\x78\x01" + stream + struct.pack(">I", deflate.adler32(data))
