/* The long part of a CRC-32 with carry-less products: data folded to 16 bytes of the same remainder.
 *
 * After Gopal et al., "Fast CRC Computation for Generic Polynomials Using PCLMULQDQ" (Intel, 2009). The factors
 * are remainders of powers of x by the polynomial 0x104C11DB7, their bits in the order of the data. Not here:
 * what is left of the data, the remainder itself (zlib's crc32 does both).
 */
#ifndef VIAPOINT_FOLD_H
#define VIAPOINT_FOLD_H

#define LANES 4
#define LANE 16

#if defined(__GNUC__) && defined(__x86_64__)
#include <immintrin.h>

#define FOLDING __attribute__((target("pclmul,sse2")))

static int folds(void) { return __builtin_cpu_supports("pclmul"); }

/* `x` carried over as many bytes as the factors are made for, and added to `y`. */
FOLDING static __m128i carried(__m128i x, __m128i factors, __m128i y) {
    __m128i low = _mm_clmulepi64_si128(x, factors, 0x00), high = _mm_clmulepi64_si128(x, factors, 0x11);
    return _mm_xor_si128(_mm_xor_si128(low, high), y);
}

/* `blocks` >= 1 blocks of LANES lanes, after a CRC in the state `state`, to one lane. */
FOLDING static void fold(const unsigned char *data, long blocks, unsigned int state, unsigned char *folded) {
    const __m128i over_block = _mm_set_epi64x(0x1c6e41596, 0x154442bd4); /* LANES lanes on */
    const __m128i over_lane = _mm_set_epi64x(0x0ccaa009e, 0x1751997d0);
    const __m128i *next = (const __m128i *)data;
    __m128i lane[LANES];
    for (int k = 0; k < LANES; k++) lane[k] = _mm_loadu_si128(next++);
    lane[0] = _mm_xor_si128(lane[0], _mm_cvtsi32_si128((int)state));
    while (--blocks > 0)
        for (int k = 0; k < LANES; k++) lane[k] = carried(lane[k], over_block, _mm_loadu_si128(next++));
    for (int k = 1; k < LANES; k++) lane[k] = carried(lane[k - 1], over_lane, lane[k]);
    _mm_storeu_si128((__m128i *)folded, lane[LANES - 1]);
}

#else

static int folds(void) { return 0; }

static void fold(const unsigned char *data, long blocks, unsigned int state, unsigned char *folded) {
    (void)data, (void)blocks, (void)state, (void)folded;
}

#endif
#endif
