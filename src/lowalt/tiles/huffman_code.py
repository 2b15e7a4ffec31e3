"""Lengths and codes of a Huffman code for DEFLATE.

Plain loops, because NumPy's sort, concatenate and sum would take longer to compile than the rest of
the stage.
"""

import numpy as np

from lowalt.machine.jit import PLAIN

LONGEST = 15
"""Bits of the longest code that DEFLATE allows for literals and lengths (RFC 1951, section 3.2.7).
"""


@PLAIN
def _sort(weights, order):
    """Fill `order` with the symbols that occur, by rising weight and then by number.

    Returns how many there are.
    """
    nodes = 0
    for symbol in range(weights.size):
        if weights[symbol] == 0:
            continue
        at = nodes
        while at > 0 and weights[order[at - 1]] > weights[symbol]:
            order[at] = order[at - 1]
            at -= 1
        order[at] = symbol
        nodes += 1
    return nodes


@PLAIN
def _depths(weights, order, nodes):
    """Return the depth of each leaf in Huffman's tree over symbols `order`, and the largest depth.

    The depths (2 nodes,) have the leaves first.
    """
    weight = np.zeros(2 * nodes, np.int64)
    parent = np.zeros(2 * nodes, np.int64)
    depth = np.zeros(2 * nodes, np.int64)
    for node in range(nodes):
        weight[node] = weights[order[node]]
    leaf = 0
    inner = nodes
    for new in range(nodes, 2 * nodes - 1):
        for _ in range(2):
            # Two queues in rising order: leaves, and inner nodes as they are made.
            if leaf < nodes and (inner >= new or weight[leaf] <= weight[inner]):
                child = leaf
                leaf += 1
            else:
                child = inner
                inner += 1
            weight[new] += weight[child]
            parent[child] = new
    deepest = 0
    for node in range(2 * nodes - 3, -1, -1):
        depth[node] = depth[parent[node]] + 1
        deepest = max(deepest, depth[node])
    return depth, deepest


@PLAIN
def code_lengths(counts, longest):
    """Lengths of a Huffman code for `counts`, at most `longest` bits.

    They are 0 for symbols that do not occur.

    Ties go to the lower symbol. Where the best code is too long, counts are halved until it fits.
    """
    weights = counts.copy()
    result = np.zeros(counts.size, np.int64)
    order = np.empty(counts.size, np.int64)
    while True:
        nodes = _sort(weights, order)
        if nodes < 2:
            if nodes == 1:
                result[order[0]] = 1
            return result
        depth, deepest = _depths(weights, order, nodes)
        if deepest <= longest:
            for node in range(nodes):
                result[order[node]] = depth[node]
            return result
        for node in range(nodes):
            weights[order[node]] = weights[order[node]] // 2 + 1


@PLAIN
def canonical_codes(lengths):
    """Codes of these lengths by RFC 1951, section 3.2.2, bits already turned round for writing."""
    codes = np.zeros(lengths.size, np.uint64)
    code = 0
    for length in range(1, LONGEST + 1):
        for symbol in range(lengths.size):
            if lengths[symbol] == length:
                turned = 0
                for bit in range(length):
                    turned |= ((code >> bit) & 1) << (length - 1 - bit)
                codes[symbol] = turned
                code += 1
        code <<= 1
    return codes
