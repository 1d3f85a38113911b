/* Sixteen float lanes, whatever the machine: one AVX-512 register, two AVX2 registers, or a plain array.
 *
 * Every operation here gives the same bits on every path (IEEE single operations, explicit fused
 * multiply-add, fixed reduction trees), so a pass written with it once gives the same result on every
 * instruction set. No approximate instruction (rcp, rsqrt) is used: they differ between vendors. pair.h
 * defines SIMD_AVX512, SIMD_AVX2 or neither; for all other files this is plain C. */
#ifndef SKIFF_BASE_SIMD_H
#define SKIFF_BASE_SIMD_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#if defined(SIMD_AVX512) || defined(SIMD_AVX2)
#include <immintrin.h>
#endif

enum { LANES = 16 };

typedef float Float4[4];

static inline const float *float4_at(const Float4 *base, int32_t halves) {
    return (const float *)((const char *)base + 8 * (ptrdiff_t)halves);
}

#if defined(SIMD_AVX512)

typedef __m512 Vf;
typedef __m512i Vi;
typedef __mmask16 Vm;

static inline Vf vf_set(float a) {
    return _mm512_set1_ps(a);
}
static inline Vf vf_load(const float *p) {
    return _mm512_loadu_ps(p);
}
static inline void vf_store(float *p, Vf a) {
    _mm512_storeu_ps(p, a);
}
static inline Vf vf_add(Vf a, Vf b) {
    return _mm512_add_ps(a, b);
}
static inline Vf vf_sub(Vf a, Vf b) {
    return _mm512_sub_ps(a, b);
}
/* a > b ? a : b */
static inline Vf vf_max(Vf a, Vf b) {
    return _mm512_max_ps(a, b);
}
static inline Vf vf_mul(Vf a, Vf b) {
    return _mm512_mul_ps(a, b);
}
/* a * b + c, rounded once */
static inline Vf vf_fma(Vf a, Vf b, Vf c) {
    return _mm512_fmadd_ps(a, b, c);
}
/* c - a * b, rounded once */
static inline Vf vf_fnma(Vf a, Vf b, Vf c) {
    return _mm512_fnmadd_ps(a, b, c);
}
static inline Vm vf_less(Vf a, Vf b) {
    return _mm512_cmp_ps_mask(a, b, _CMP_LT_OQ);
}
static inline Vf vf_select(Vm m, Vf yes, Vf no) {
    return _mm512_mask_blend_ps(m, no, yes);
}
static inline Vi vi_set(int32_t a) {
    return _mm512_set1_epi32(a);
}
static inline Vi vi_load(const int32_t *p) {
    return _mm512_loadu_si512(p);
}
static inline Vi vi_add(Vi a, Vi b) {
    return _mm512_add_epi32(a, b);
}
static inline void vi_store(int32_t *p, Vi a) {
    _mm512_storeu_si512(p, a);
}
static inline Vi vi_load_i16(const int16_t *p) {
    return _mm512_cvtepi16_epi32(_mm256_loadu_si256((const __m256i *)p));
}
/* keeps the low 16 bits: the caller has checked the range */
static inline void vi_store_i16(int16_t *p, Vi a) {
    _mm256_storeu_si256((__m256i *)p, _mm512_cvtepi32_epi16(a));
}
static inline Vm vi_equal(Vi a, Vi b) {
    return _mm512_cmpeq_epi32_mask(a, b);
}
static inline Vm vi_less(Vi a, Vi b) {
    return _mm512_cmplt_epi32_mask(a, b);
}
static inline Vf vf_load_i16(const int16_t *p) {
    return _mm512_cvtepi32_ps(vi_load_i16(p));
}
static inline Vf vf_load_u16(const uint16_t *p) {
    return _mm512_cvtepi32_ps(_mm512_cvtepu16_epi32(_mm256_loadu_si256((const __m256i *)p)));
}
/* to nearest even */
static inline Vi vi_round(Vf a) {
    return _mm512_cvtps_epi32(a);
}
static inline Vf vf_from_int(Vi a) {
    return _mm512_cvtepi32_ps(a);
}
static inline Vi vi_select(Vm m, Vi yes, Vi no) {
    return _mm512_mask_blend_epi32(m, no, yes);
}
/* Two numbers in the place of one, each rounded to its upper 16 bits (8 significant ones). */
static inline Vf vf_pair(Vf high, Vf low) {
    const __m512i half = _mm512_set1_epi32(0x8000), upper = _mm512_set1_epi32((int)0xffff0000u);
    const __m512i h = _mm512_and_si512(_mm512_add_epi32(_mm512_castps_si512(high), half), upper);
    const __m512i l = _mm512_srli_epi32(_mm512_add_epi32(_mm512_castps_si512(low), half), 16);
    return _mm512_castsi512_ps(_mm512_or_si512(h, l));
}
static inline Vf vf_high(Vf pair) {
    return _mm512_castsi512_ps(
        _mm512_and_si512(_mm512_castps_si512(pair), _mm512_set1_epi32((int)0xffff0000u)));
}
static inline Vf vf_low(Vf pair) {
    return _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_castps_si512(pair), 16));
}
/* to nearest even; |a| <= 32767 */
static inline void vf_store_i16(int16_t *p, Vf a) {
    vi_store_i16(p, _mm512_cvtps_epi32(a));
}
/* out[k][l] = rows[l][from + k]: sixteen rows of sixteen become columns. */
static inline void vi_transpose16(const int32_t *const rows[LANES], int from, int32_t out[LANES][LANES]) {
    __m512i quad[4][4]; /* [rows 4 i to 4 i + 3][c]: columns c, 4 + c, 8 + c, 12 + c of these */
    for (int i = 0; i < 4; i++) {
        const int32_t *const *row = rows + 4 * i;
        const __m512i a = _mm512_loadu_si512(row[0] + from), b = _mm512_loadu_si512(row[1] + from);
        const __m512i c = _mm512_loadu_si512(row[2] + from), d = _mm512_loadu_si512(row[3] + from);
        const __m512i ab_low = _mm512_unpacklo_epi32(a, b), ab_high = _mm512_unpackhi_epi32(a, b);
        const __m512i cd_low = _mm512_unpacklo_epi32(c, d), cd_high = _mm512_unpackhi_epi32(c, d);
        quad[i][0] = _mm512_unpacklo_epi64(ab_low, cd_low);
        quad[i][1] = _mm512_unpackhi_epi64(ab_low, cd_low);
        quad[i][2] = _mm512_unpacklo_epi64(ab_high, cd_high);
        quad[i][3] = _mm512_unpackhi_epi64(ab_high, cd_high);
    }
    for (int c = 0; c < 4; c++) {
        const __m512i a = _mm512_shuffle_i32x4(quad[0][c], quad[1][c], 0x44);
        const __m512i b = _mm512_shuffle_i32x4(quad[0][c], quad[1][c], 0xEE);
        const __m512i e = _mm512_shuffle_i32x4(quad[2][c], quad[3][c], 0x44);
        const __m512i f = _mm512_shuffle_i32x4(quad[2][c], quad[3][c], 0xEE);
        _mm512_storeu_si512(out[c], _mm512_shuffle_i32x4(a, e, 0x88));
        _mm512_storeu_si512(out[4 + c], _mm512_shuffle_i32x4(a, e, 0xDD));
        _mm512_storeu_si512(out[8 + c], _mm512_shuffle_i32x4(b, f, 0x88));
        _mm512_storeu_si512(out[12 + c], _mm512_shuffle_i32x4(b, f, 0xDD));
    }
}
static inline void vf_transpose4(__m512 r[4], Vf *x, Vf *y, Vf *z, Vf *w) {
    __m512 t0 = _mm512_unpacklo_ps(r[0], r[1]), t1 = _mm512_unpackhi_ps(r[0], r[1]);
    __m512 t2 = _mm512_unpacklo_ps(r[2], r[3]), t3 = _mm512_unpackhi_ps(r[2], r[3]);
    *x = _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(t0), _mm512_castps_pd(t2)));
    *y = _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(t0), _mm512_castps_pd(t2)));
    *z = _mm512_castpd_ps(_mm512_unpacklo_pd(_mm512_castps_pd(t1), _mm512_castps_pd(t3)));
    *w = _mm512_castpd_ps(_mm512_unpackhi_pd(_mm512_castps_pd(t1), _mm512_castps_pd(t3)));
}
/* Four floats each of the sixteen Float4 that lie halves[lane] / 2 places from base. One 128-bit load a lane
 * and a transpose beat four gathers by a third. The offsets are in memory: scalar loads leave the vector
 * units to the transpose, while taking them out of a register costs as much as the rest. And they count half
 * a Float4: scaled by eight an offset is part of an address, by sixteen it would need an instruction of its
 * own. */
#define GATHER4(base, halves, x, y, z, w)                                                                    \
    __m512 r[4];                                                                                             \
    for (int k = 0; k < 4; k++) {                                                                            \
        r[k] = _mm512_castps128_ps512(_mm_loadu_ps(float4_at(base, halves[k])));                             \
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(float4_at(base, halves[4 + k])), 1);                    \
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(float4_at(base, halves[8 + k])), 2);                    \
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(float4_at(base, halves[12 + k])), 3);                   \
    }                                                                                                        \
    vf_transpose4(r, x, y, z, w)
static inline void vf_gather4_i32(const Float4 *base, const int32_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w);
}
static inline void vf_gather4_i16(const Float4 *base, const int16_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w);
}
#undef GATHER4
/* Sixteen consecutive Float4 to four registers. */
static inline void vf_load4(const Float4 *p, Vf *x, Vf *y, Vf *z, Vf *w) {
    __m512 r[4];
    for (int k = 0; k < 4; k++) {
        r[k] = _mm512_castps128_ps512(_mm_loadu_ps(p[k]));
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(p[4 + k]), 1);
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(p[8 + k]), 2);
        r[k] = _mm512_insertf32x4(r[k], _mm_loadu_ps(p[12 + k]), 3);
    }
    vf_transpose4(r, x, y, z, w);
}
static inline void vf_store4(Float4 *p, Vf x, Vf y, Vf z, Vf w) {
    __m512 r[4] = {x, y, z, w}, a, b, c, d;
    vf_transpose4(r, &a, &b, &c, &d);
    __m512 out[4] = {a, b, c, d};
    for (int k = 0; k < 4; k++) {
        _mm_storeu_ps(p[k], _mm512_castps512_ps128(out[k]));
        _mm_storeu_ps(p[4 + k], _mm512_extractf32x4_ps(out[k], 1));
        _mm_storeu_ps(p[8 + k], _mm512_extractf32x4_ps(out[k], 2));
        _mm_storeu_ps(p[12 + k], _mm512_extractf32x4_ps(out[k], 3));
    }
}
/* Bit pattern shifted right by one and subtracted from `magic`: the seed of vf_rsqrt. */
static inline Vf vf_rsqrt_seed(Vf a, int32_t magic) {
    return _mm512_castsi512_ps(
        _mm512_sub_epi32(_mm512_set1_epi32(magic), _mm512_srli_epi32(_mm512_castps_si512(a), 1)));
}
static inline float vf_sum(Vf a) {
    __m256 h = _mm256_add_ps(_mm512_castps512_ps256(a), _mm512_extractf32x8_ps(a, 1));
    __m128 q = _mm_add_ps(_mm256_castps256_ps128(h), _mm256_extractf128_ps(h, 1));
    q = _mm_add_ps(q, _mm_movehl_ps(q, q));
    return _mm_cvtss_f32(_mm_add_ss(q, _mm_movehdup_ps(q)));
}
/* Appends the set lanes of v to out, in lane order; may write up to 16 places; returns how many count. */
static inline int vi_compress(int32_t *out, Vi v, Vm m) {
    /* compress in the register, then store: compressing to memory is microcoded on Zen 4 */
    _mm512_storeu_si512(out, _mm512_maskz_compress_epi32(m, v));
    return __builtin_popcount(m);
}
static inline int vf_compress(float *out, Vf v, Vm m) {
    _mm512_storeu_ps(out, _mm512_maskz_compress_ps(m, v));
    return __builtin_popcount(m);
}

#elif defined(SIMD_AVX2)

typedef struct Vf {
    __m256 a, b;
} Vf;
typedef struct Vi {
    __m256i a, b;
} Vi;
typedef uint32_t Vm;

#define VF(x, y)                                                                                             \
    (Vf) {                                                                                                   \
        x, y                                                                                                 \
    }
static inline Vf vf_set(float v) {
    return VF(_mm256_set1_ps(v), _mm256_set1_ps(v));
}
static inline Vf vf_load(const float *p) {
    return VF(_mm256_loadu_ps(p), _mm256_loadu_ps(p + 8));
}
static inline void vf_store(float *p, Vf v) {
    _mm256_storeu_ps(p, v.a);
    _mm256_storeu_ps(p + 8, v.b);
}
static inline Vf vf_add(Vf u, Vf v) {
    return VF(_mm256_add_ps(u.a, v.a), _mm256_add_ps(u.b, v.b));
}
static inline Vf vf_sub(Vf u, Vf v) {
    return VF(_mm256_sub_ps(u.a, v.a), _mm256_sub_ps(u.b, v.b));
}
static inline Vf vf_max(Vf u, Vf v) {
    return VF(_mm256_max_ps(u.a, v.a), _mm256_max_ps(u.b, v.b));
}
static inline Vf vf_mul(Vf u, Vf v) {
    return VF(_mm256_mul_ps(u.a, v.a), _mm256_mul_ps(u.b, v.b));
}
static inline Vf vf_fma(Vf u, Vf v, Vf w) {
    return VF(_mm256_fmadd_ps(u.a, v.a, w.a), _mm256_fmadd_ps(u.b, v.b, w.b));
}
static inline Vf vf_fnma(Vf u, Vf v, Vf w) {
    return VF(_mm256_fnmadd_ps(u.a, v.a, w.a), _mm256_fnmadd_ps(u.b, v.b, w.b));
}
static inline Vm vf_less(Vf u, Vf v) {
    uint32_t lo = (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(u.a, v.a, _CMP_LT_OQ));
    return lo | (uint32_t)_mm256_movemask_ps(_mm256_cmp_ps(u.b, v.b, _CMP_LT_OQ)) << 8;
}
static inline __m256i vm_expand(Vm m) {
    const __m256i bit = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
    return _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32((int)m), bit), bit);
}
static inline Vf vf_select(Vm m, Vf yes, Vf no) {
    return VF(_mm256_blendv_ps(no.a, yes.a, _mm256_castsi256_ps(vm_expand(m))),
              _mm256_blendv_ps(no.b, yes.b, _mm256_castsi256_ps(vm_expand(m >> 8))));
}
static inline Vi vi_set(int32_t v) {
    return (Vi){_mm256_set1_epi32(v), _mm256_set1_epi32(v)};
}
static inline Vi vi_load(const int32_t *p) {
    return (Vi){_mm256_loadu_si256((const __m256i *)p), _mm256_loadu_si256((const __m256i *)(p + 8))};
}
static inline Vi vi_add(Vi u, Vi v) {
    return (Vi){_mm256_add_epi32(u.a, v.a), _mm256_add_epi32(u.b, v.b)};
}
static inline void vi_store(int32_t *p, Vi v) {
    _mm256_storeu_si256((__m256i *)p, v.a);
    _mm256_storeu_si256((__m256i *)(p + 8), v.b);
}
static inline Vi vi_load_i16(const int16_t *p) {
    return (Vi){_mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)p)),
                _mm256_cvtepi16_epi32(_mm_loadu_si128((const __m128i *)(p + 8)))};
}
/* packing saturates: the low 16 bits first */
static inline __m256i avx2_low_16(Vi v) {
    const __m256i low = _mm256_set1_epi32(0xffff);
    const __m256i packed = _mm256_packus_epi32(_mm256_and_si256(v.a, low), _mm256_and_si256(v.b, low));
    return _mm256_permute4x64_epi64(packed, 0xD8);
}
static inline void vi_store_i16(int16_t *p, Vi v) {
    _mm256_storeu_si256((__m256i *)p, avx2_low_16(v));
}
static inline Vm vi_mask(__m256i a, __m256i b) {
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(a)) |
           (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(b)) << 8;
}
static inline Vm vi_equal(Vi u, Vi v) {
    return vi_mask(_mm256_cmpeq_epi32(u.a, v.a), _mm256_cmpeq_epi32(u.b, v.b));
}
static inline Vm vi_less(Vi u, Vi v) {
    return vi_mask(_mm256_cmpgt_epi32(v.a, u.a), _mm256_cmpgt_epi32(v.b, u.b));
}
static inline Vf vf_load_i16(const int16_t *p) {
    Vi i = vi_load_i16(p);
    return VF(_mm256_cvtepi32_ps(i.a), _mm256_cvtepi32_ps(i.b));
}
static inline Vf vf_load_u16(const uint16_t *p) {
    return VF(_mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)p))),
              _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(p + 8)))));
}
static inline Vi vi_round(Vf v) {
    return (Vi){_mm256_cvtps_epi32(v.a), _mm256_cvtps_epi32(v.b)};
}
static inline Vf vf_from_int(Vi v) {
    return VF(_mm256_cvtepi32_ps(v.a), _mm256_cvtepi32_ps(v.b));
}
static inline Vi vi_select(Vm m, Vi yes, Vi no) {
    return (Vi){_mm256_blendv_epi8(no.a, yes.a, vm_expand(m)),
                _mm256_blendv_epi8(no.b, yes.b, vm_expand(m >> 8))};
}
static inline __m256 avx2_pair(__m256 high, __m256 low) {
    const __m256i half = _mm256_set1_epi32(0x8000), upper = _mm256_set1_epi32((int)0xffff0000u);
    const __m256i h = _mm256_and_si256(_mm256_add_epi32(_mm256_castps_si256(high), half), upper);
    const __m256i l = _mm256_srli_epi32(_mm256_add_epi32(_mm256_castps_si256(low), half), 16);
    return _mm256_castsi256_ps(_mm256_or_si256(h, l));
}
static inline Vf vf_pair(Vf high, Vf low) {
    return VF(avx2_pair(high.a, low.a), avx2_pair(high.b, low.b));
}
static inline Vf vf_high(Vf pair) {
    const __m256 upper = _mm256_castsi256_ps(_mm256_set1_epi32((int)0xffff0000u));
    return VF(_mm256_and_ps(pair.a, upper), _mm256_and_ps(pair.b, upper));
}
static inline Vf vf_low(Vf pair) {
    return VF(_mm256_castsi256_ps(_mm256_slli_epi32(_mm256_castps_si256(pair.a), 16)),
              _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_castps_si256(pair.b), 16)));
}
static inline void vf_store_i16(int16_t *p, Vf v) {
    vi_store_i16(p, (Vi){_mm256_cvtps_epi32(v.a), _mm256_cvtps_epi32(v.b)});
}
/* r[k] holds points k (low half) and 4 + k (high half) */
static inline void avx2_transpose4(const __m256 r[4], __m256 out[4]) {
    __m256 t0 = _mm256_unpacklo_ps(r[0], r[1]), t1 = _mm256_unpackhi_ps(r[0], r[1]);
    __m256 t2 = _mm256_unpacklo_ps(r[2], r[3]), t3 = _mm256_unpackhi_ps(r[2], r[3]);
    out[0] = _mm256_shuffle_ps(t0, t2, 0x44);
    out[1] = _mm256_shuffle_ps(t0, t2, 0xEE);
    out[2] = _mm256_shuffle_ps(t1, t3, 0x44);
    out[3] = _mm256_shuffle_ps(t1, t3, 0xEE);
}
#define GATHER4(base, halves, x, y, z, w)                                                                    \
    __m256 out[2][4];                                                                                        \
    for (int half = 0; half < 2; half++) {                                                                   \
        __m256 r[4];                                                                                         \
        for (int k = 0; k < 4; k++)                                                                          \
            r[k] = _mm256_insertf128_ps(                                                                     \
                _mm256_castps128_ps256(_mm_loadu_ps(float4_at(base, halves[8 * half + k]))),                 \
                _mm_loadu_ps(float4_at(base, halves[8 * half + 4 + k])), 1);                                 \
        avx2_transpose4(r, out[half]);                                                                       \
    }                                                                                                        \
    *x = VF(out[0][0], out[1][0]);                                                                           \
    *y = VF(out[0][1], out[1][1]);                                                                           \
    *z = VF(out[0][2], out[1][2]);                                                                           \
    *w = VF(out[0][3], out[1][3])
static inline void vf_gather4_i32(const Float4 *base, const int32_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w);
}
static inline void vf_gather4_i16(const Float4 *base, const int16_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w);
}
static inline void vf_load4(const Float4 *p, Vf *x, Vf *y, Vf *z, Vf *w) {
    static const int32_t in_order[LANES] = {0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30};
    GATHER4(p, in_order, x, y, z, w);
}
#undef GATHER4
static inline void avx2_store4(Float4 *p, __m256 x, __m256 y, __m256 z, __m256 w) {
    __m256 r[4] = {x, y, z, w}, out[4];
    avx2_transpose4(r, out);
    for (int k = 0; k < 4; k++) {
        _mm_storeu_ps(p[k], _mm256_castps256_ps128(out[k]));
        _mm_storeu_ps(p[4 + k], _mm256_extractf128_ps(out[k], 1));
    }
}
static inline void vf_store4(Float4 *p, Vf x, Vf y, Vf z, Vf w) {
    avx2_store4(p, x.a, y.a, z.a, w.a);
    avx2_store4(p + 8, x.b, y.b, z.b, w.b);
}
static inline __m256 avx2_rsqrt_seed(__m256 v, int32_t magic) {
    return _mm256_castsi256_ps(
        _mm256_sub_epi32(_mm256_set1_epi32(magic), _mm256_srli_epi32(_mm256_castps_si256(v), 1)));
}
static inline Vf vf_rsqrt_seed(Vf v, int32_t magic) {
    return VF(avx2_rsqrt_seed(v.a, magic), avx2_rsqrt_seed(v.b, magic));
}
static inline float vf_sum(Vf v) {
    __m256 h = _mm256_add_ps(v.a, v.b);
    __m128 q = _mm_add_ps(_mm256_castps256_ps128(h), _mm256_extractf128_ps(h, 1));
    q = _mm_add_ps(q, _mm_movehl_ps(q, q));
    return _mm_cvtss_f32(_mm_add_ss(q, _mm_movehdup_ps(q)));
}
/* Four lanes at a time, by a table of byte shuffles: walking the bits costs a wrong guess of their number. */
#define BYTES(lane) 4 * (lane), 4 * (lane) + 1, 4 * (lane) + 2, 4 * (lane) + 3
static const uint8_t avx2_compress_bytes[16][16] = {
    {0},
    {BYTES(0)},
    {BYTES(1)},
    {BYTES(0), BYTES(1)},
    {BYTES(2)},
    {BYTES(0), BYTES(2)},
    {BYTES(1), BYTES(2)},
    {BYTES(0), BYTES(1), BYTES(2)},
    {BYTES(3)},
    {BYTES(0), BYTES(3)},
    {BYTES(1), BYTES(3)},
    {BYTES(0), BYTES(1), BYTES(3)},
    {BYTES(2), BYTES(3)},
    {BYTES(0), BYTES(2), BYTES(3)},
    {BYTES(1), BYTES(2), BYTES(3)},
    {BYTES(0), BYTES(1), BYTES(2), BYTES(3)},
};
#undef BYTES
static inline int vi_compress(int32_t *out, Vi v, Vm m) {
    const __m128i quads[4] = {_mm256_castsi256_si128(v.a), _mm256_extracti128_si256(v.a, 1),
                              _mm256_castsi256_si128(v.b), _mm256_extracti128_si256(v.b, 1)};
    int n = 0;
    for (int q = 0; q < 4; q++, m >>= 4) {
        const __m128i bytes = _mm_loadu_si128((const __m128i *)avx2_compress_bytes[m & 15]);
        _mm_storeu_si128((__m128i *)(out + n), _mm_shuffle_epi8(quads[q], bytes));
        n += __builtin_popcount(m & 15);
    }
    return n;
}
static inline int vf_compress(float *out, Vf v, Vm m) {
    return vi_compress((int32_t *)(void *)out, (Vi){_mm256_castps_si256(v.a), _mm256_castps_si256(v.b)}, m);
}

#else

typedef struct Vf {
    float v[LANES];
} Vf;
typedef struct Vi {
    int32_t v[LANES];
} Vi;
typedef uint32_t Vm;

#define EACH_LANE for (int l = 0; l < LANES; l++)
static inline Vf vf_set(float a) {
    Vf r;
    EACH_LANE r.v[l] = a;
    return r;
}
static inline Vf vf_load(const float *p) {
    Vf r;
    memcpy(r.v, p, sizeof r.v);
    return r;
}
static inline void vf_store(float *p, Vf a) {
    memcpy(p, a.v, sizeof a.v);
}
static inline Vf vf_add(Vf a, Vf b) {
    EACH_LANE a.v[l] += b.v[l];
    return a;
}
static inline Vf vf_sub(Vf a, Vf b) {
    EACH_LANE a.v[l] -= b.v[l];
    return a;
}
static inline Vf vf_max(Vf a, Vf b) {
    EACH_LANE a.v[l] = a.v[l] > b.v[l] ? a.v[l] : b.v[l];
    return a;
}
static inline Vf vf_mul(Vf a, Vf b) {
    EACH_LANE a.v[l] *= b.v[l];
    return a;
}
static inline Vf vf_fma(Vf a, Vf b, Vf c) {
    EACH_LANE c.v[l] = fmaf(a.v[l], b.v[l], c.v[l]);
    return c;
}
static inline Vf vf_fnma(Vf a, Vf b, Vf c) {
    EACH_LANE c.v[l] = fmaf(-a.v[l], b.v[l], c.v[l]);
    return c;
}
static inline Vm vf_less(Vf a, Vf b) {
    Vm m = 0;
    EACH_LANE m |= (Vm)(a.v[l] < b.v[l]) << l;
    return m;
}
static inline Vf vf_select(Vm m, Vf yes, Vf no) {
    EACH_LANE no.v[l] = m >> l & 1 ? yes.v[l] : no.v[l];
    return no;
}
static inline Vi vi_set(int32_t a) {
    Vi r;
    EACH_LANE r.v[l] = a;
    return r;
}
static inline Vi vi_load(const int32_t *p) {
    Vi r;
    memcpy(r.v, p, sizeof r.v);
    return r;
}
static inline Vi vi_add(Vi a, Vi b) {
    EACH_LANE a.v[l] += b.v[l];
    return a;
}
static inline void vi_store(int32_t *p, Vi a) {
    memcpy(p, a.v, sizeof a.v);
}
static inline Vi vi_load_i16(const int16_t *p) {
    Vi r;
    EACH_LANE r.v[l] = p[l];
    return r;
}
static inline void vi_store_i16(int16_t *p, Vi a) {
    EACH_LANE p[l] = (int16_t)a.v[l];
}
static inline Vm vi_equal(Vi a, Vi b) {
    Vm m = 0;
    EACH_LANE m |= (Vm)(a.v[l] == b.v[l]) << l;
    return m;
}
static inline Vm vi_less(Vi a, Vi b) {
    Vm m = 0;
    EACH_LANE m |= (Vm)(a.v[l] < b.v[l]) << l;
    return m;
}
static inline Vf vf_load_i16(const int16_t *p) {
    Vf r;
    EACH_LANE r.v[l] = (float)p[l];
    return r;
}
static inline Vf vf_load_u16(const uint16_t *p) {
    Vf r;
    EACH_LANE r.v[l] = (float)p[l];
    return r;
}
static inline Vi vi_round(Vf a) {
    Vi r;
    EACH_LANE r.v[l] = (int32_t)lrintf(a.v[l]);
    return r;
}
static inline Vf vf_from_int(Vi a) {
    Vf r;
    EACH_LANE r.v[l] = (float)a.v[l];
    return r;
}
static inline Vi vi_select(Vm m, Vi yes, Vi no) {
    EACH_LANE no.v[l] = m >> l & 1 ? yes.v[l] : no.v[l];
    return no;
}
static inline uint32_t float_bits(float a) {
    uint32_t bits;
    memcpy(&bits, &a, sizeof bits);
    return bits;
}
static inline float float_of(uint32_t bits) {
    float a;
    memcpy(&a, &bits, sizeof a);
    return a;
}
static inline Vf vf_pair(Vf high, Vf low) {
    EACH_LANE high.v[l] =
        float_of(((float_bits(high.v[l]) + 0x8000u) & 0xffff0000u) | (float_bits(low.v[l]) + 0x8000u) >> 16);
    return high;
}
static inline Vf vf_high(Vf pair) {
    EACH_LANE pair.v[l] = float_of(float_bits(pair.v[l]) & 0xffff0000u);
    return pair;
}
static inline Vf vf_low(Vf pair) {
    EACH_LANE pair.v[l] = float_of(float_bits(pair.v[l]) << 16);
    return pair;
}
static inline void vf_store_i16(int16_t *p, Vf a) {
    EACH_LANE p[l] = (int16_t)lrintf(a.v[l]);
}
#define GATHER4(base, halves, x, y, z, w)                                                                    \
    EACH_LANE {                                                                                              \
        const float *p = float4_at(base, halves[l]);                                                         \
        x->v[l] = p[0];                                                                                      \
        y->v[l] = p[1];                                                                                      \
        z->v[l] = p[2];                                                                                      \
        w->v[l] = p[3];                                                                                      \
    }
static inline void vf_gather4_i32(const Float4 *base, const int32_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w)
}
static inline void vf_gather4_i16(const Float4 *base, const int16_t *halves, Vf *x, Vf *y, Vf *z, Vf *w) {
    GATHER4(base, halves, x, y, z, w)
}
#undef GATHER4
static inline void vf_load4(const Float4 *p, Vf *x, Vf *y, Vf *z, Vf *w) {
    EACH_LANE {
        x->v[l] = p[l][0];
        y->v[l] = p[l][1];
        z->v[l] = p[l][2];
        w->v[l] = p[l][3];
    }
}
static inline void vf_store4(Float4 *p, Vf x, Vf y, Vf z, Vf w) {
    EACH_LANE {
        p[l][0] = x.v[l];
        p[l][1] = y.v[l];
        p[l][2] = z.v[l];
        p[l][3] = w.v[l];
    }
}
static inline Vf vf_rsqrt_seed(Vf a, int32_t magic) {
    EACH_LANE {
        uint32_t bits;
        memcpy(&bits, &a.v[l], 4);
        bits = (uint32_t)magic - (bits >> 1);
        memcpy(&a.v[l], &bits, 4);
    }
    return a;
}
static inline float vf_sum(Vf a) {
    for (int width = 8; width >= 1; width /= 2)
        for (int l = 0; l < width; l++)
            a.v[l] += a.v[l + width];
    return a.v[0];
}
static inline int vi_compress(int32_t *out, Vi v, Vm m) {
    int n = 0;
    for (; m != 0; m &= m - 1)
        out[n++] = v.v[__builtin_ctz(m)];
    return n;
}
static inline int vf_compress(float *out, Vf v, Vm m) {
    int n = 0;
    for (; m != 0; m &= m - 1)
        out[n++] = v.v[__builtin_ctz(m)];
    return n;
}
#undef EACH_LANE

#endif

/* ---- On top of the above, the same text on every path ---- */

#ifndef SIMD_AVX512
static inline void vi_transpose16(const int32_t *const rows[LANES], int from, int32_t out[LANES][LANES]) {
    for (int k = 0; k < LANES; k++)
        for (int l = 0; l < LANES; l++)
            out[k][l] = rows[l][from + k];
}
#endif

static inline Vf vf_zero(void) {
    return vf_set(0.0f);
}
static inline Vf vf_mask(Vm m, Vf a) {
    return vf_select(m, a, vf_zero());
}
static inline Vi vi_lane(void) {
    static const int32_t lane[LANES] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
    return vi_load(lane);
}

/* 1 / sqrt(a), relative error below 5e-7 for normal a > 0: a seed by the bits and two Newton steps whose
 * constants share the error out on both sides [Moroz, Walczyk et al. 2018; the last constant by search]. A
 * division and a square root take three times as long, and the machines' own estimates differ from vendor to
 * vendor. */
static inline Vf vf_rsqrt(Vf a) {
    const Vf half = vf_mul(a, vf_set(0.5f)), seed = vf_rsqrt_seed(a, 0x5f1ffff9);
    const Vf y =
        vf_mul(vf_mul(vf_set(0.703952253f), seed), vf_fnma(vf_mul(a, seed), seed, vf_set(2.38924456f)));
    return vf_mul(y, vf_fnma(vf_mul(half, y), y, vf_set(1.50000036f)));
}

#endif
