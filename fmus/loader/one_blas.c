/* numpy's calls of BLAS and LAPACK, passed on to the copy of OpenBLAS that scipy brings.
 *
 * Wheels of numpy and scipy bring a copy each, and these are half of a runtime. They differ in the width of integers:
 * numpy's takes 64 bits (names end in 64_), scipy's 32. This library has the names of the former and hands over to the
 * latter; it computes nothing itself. On x86-64 an argument of 64 bits is read rightly as one of 32, in a register, on the
 * stack and through a pointer, as long as the number fits, and a matrix of 2^31 rows does not fit into an FMU. What comes
 * back through a pointer has 32 bits, so it is widened here.
 */
#include <stdint.h>

typedef void *P;

static void widen(P result) { *(int64_t *)result = *(int32_t *)result; }

/* Pivots, from the last one on, for both kinds lie in the same place. */
static void widen_all(P results, int64_t count) {
    volatile int32_t *from = results;
    volatile int64_t *to = results;
    for (int64_t i = count - 1; i >= 0; i--) to[i] = from[i];
}

static int64_t smaller(P one, P other) {
    int64_t a = *(int64_t *)one, b = *(int64_t *)other;
    return a < b ? a : b;
}

/* Functions that hand back nothing but floating-point numbers. */
#define JUMP(FROM, TO)                                                                                               \
    __asm__(".globl " #FROM "\n.type " #FROM ", @function\n" #FROM ": jmp *" #TO "@GOTPCREL(%rip)\n");
#define CBLAS(NAME) JUMP(scipy_cblas_##NAME##64_, scipy_cblas_##NAME)
#define CBLAS_OF_ALL(NAME) CBLAS(s##NAME) CBLAS(d##NAME) CBLAS(c##NAME) CBLAS(z##NAME)

__asm__(".text\n");
CBLAS_OF_ALL(gemm) CBLAS_OF_ALL(gemv) CBLAS_OF_ALL(syrk) CBLAS_OF_ALL(axpy)
CBLAS(sdot) CBLAS(ddot) CBLAS(cdotc_sub) CBLAS(zdotc_sub) CBLAS(cdotu_sub) CBLAS(zdotu_sub)

/* numpy counts a negative stride in unsigned numbers: a huge one that makes the right address in 64 bits, and would not
 * in 32. So vectors are copied here. */
#define COPY(T, TYPE)                                                                                                \
    void scipy_##T##copy_64_(const int64_t *n, const TYPE *x, const int64_t *incx, TYPE *y, const int64_t *incy) {   \
        uint64_t from = first(*n, *incx), to = first(*n, *incy);                                                     \
        for (int64_t i = 0; i < *n; i++, from += (uint64_t)*incx, to += (uint64_t)*incy)                             \
            *(TYPE *)((uint64_t)y + to * sizeof *y) = *(const TYPE *)((uint64_t)x + from * sizeof *x);               \
    }

/* Where the first one lies: with a stride below zero, behind the others. */
static uint64_t first(int64_t count, int64_t stride) { return stride < 0 ? (uint64_t)((1 - count) * stride) : 0; }

COPY(s, float) COPY(d, double) COPY(c, float _Complex) COPY(z, double _Complex)

/* A function of LAPACK: its parameters, its arguments, and what is done with its results. */
#define LAPACK(NAME, PARAMETERS, ARGUMENTS, AFTER)                                                                   \
    extern void scipy_##NAME##_ PARAMETERS;                                                                          \
    void scipy_##NAME##_64_ PARAMETERS {                                                                             \
        scipy_##NAME##_ ARGUMENTS;                                                                                   \
        AFTER;                                                                                                       \
    }

#define GESV(T)                                                                                                      \
    LAPACK(T##gesv, (P n, P nrhs, P a, P lda, P pivots, P b, P ldb, P info), (n, nrhs, a, lda, pivots, b, ldb, info), \
           (widen_all(pivots, *(int64_t *)n), widen(info)))
#define GETRF(T)                                                                                                     \
    LAPACK(T##getrf, (P m, P n, P a, P lda, P pivots, P info), (m, n, a, lda, pivots, info),                         \
           (widen_all(pivots, smaller(m, n)), widen(info)))
#define POTRF(T) LAPACK(T##potrf, (P uplo, P n, P a, P lda, P info), (uplo, n, a, lda, info), widen(info))
#define GEQRF(T)                                                                                                     \
    LAPACK(T##geqrf, (P m, P n, P a, P lda, P tau, P work, P lwork, P info), (m, n, a, lda, tau, work, lwork, info), \
           widen(info))
#define FROM_QR(NAME)                                                                                                \
    LAPACK(NAME, (P m, P n, P k, P a, P lda, P tau, P work, P lwork, P info),                                        \
           (m, n, k, a, lda, tau, work, lwork, info), widen(info))
#define GEEV(T)                                                                                                      \
    LAPACK(T##geev, (P jobvl, P jobvr, P n, P a, P lda, P w, P x, P y, P z, P u, P v, P work, P lwork, P info),      \
           (jobvl, jobvr, n, a, lda, w, x, y, z, u, v, work, lwork, info), widen(info))
/* Work space of integers may be asked for its size, which comes back in its first place. */
#define GESDD(T)                                                                                                     \
    LAPACK(T##gesdd, (P job, P m, P n, P a, P lda, P s, P u, P ldu, P vt, P ldvt, P work, P lwork, P iwork, P info), \
           (job, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, iwork, info), widen(info))
#define GESDD_COMPLEX(T)                                                                                             \
    LAPACK(T##gesdd,                                                                                                 \
           (P job, P m, P n, P a, P lda, P s, P u, P ldu, P vt, P ldvt, P work, P lwork, P rwork, P iwork, P info),  \
           (job, m, n, a, lda, s, u, ldu, vt, ldvt, work, lwork, rwork, iwork, info), widen(info))
#define SYEVD(T)                                                                                                     \
    LAPACK(T##syevd, (P job, P uplo, P n, P a, P lda, P w, P work, P lwork, P iwork, P liwork, P info),              \
           (job, uplo, n, a, lda, w, work, lwork, iwork, liwork, info), (widen(iwork), widen(info)))
#define HEEVD(T)                                                                                                     \
    LAPACK(T##heevd,                                                                                                 \
           (P job, P uplo, P n, P a, P lda, P w, P work, P lwork, P rwork, P lrwork, P iwork, P liwork, P info),     \
           (job, uplo, n, a, lda, w, work, lwork, rwork, lrwork, iwork, liwork, info), (widen(iwork), widen(info)))
#define GELSD(T)                                                                                                     \
    LAPACK(T##gelsd,                                                                                                 \
           (P m, P n, P nrhs, P a, P lda, P b, P ldb, P s, P rcond, P rank, P work, P lwork, P iwork, P info),       \
           (m, n, nrhs, a, lda, b, ldb, s, rcond, rank, work, lwork, iwork, info),                                   \
           (widen(rank), widen(iwork), widen(info)))
#define GELSD_COMPLEX(T)                                                                                             \
    LAPACK(T##gelsd,                                                                                                 \
           (P m, P n, P nrhs, P a, P lda, P b, P ldb, P s, P rcond, P rank, P work, P lwork, P rwork, P iwork,       \
            P info),                                                                                                 \
           (m, n, nrhs, a, lda, b, ldb, s, rcond, rank, work, lwork, rwork, iwork, info),                            \
           (widen(rank), widen(iwork), widen(info)))

GESV(s) GESV(d) GESV(c) GESV(z)
GETRF(s) GETRF(d) GETRF(c) GETRF(z)
POTRF(s) POTRF(d) POTRF(c) POTRF(z)
GEQRF(d) GEQRF(z)
FROM_QR(dorgqr) FROM_QR(zungqr)
GEEV(s) GEEV(d) GEEV(c) GEEV(z)
GESDD(s) GESDD(d) GESDD_COMPLEX(c) GESDD_COMPLEX(z)
SYEVD(s) SYEVD(d) HEEVD(c) HEEVD(z)
GELSD(s) GELSD(d) GELSD_COMPLEX(c) GELSD_COMPLEX(z)
