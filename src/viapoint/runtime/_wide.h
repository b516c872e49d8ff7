/* WIDE: a function whose loops are compiled for wider vector units too; which one runs is decided at load. */
#ifndef VIAPOINT_WIDE_H
#define VIAPOINT_WIDE_H

#if defined(__GNUC__) && defined(__x86_64__) && defined(__linux__) && defined(__GLIBC__)
#define WIDE __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define WIDE
#endif

#endif
