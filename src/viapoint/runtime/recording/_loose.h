/* Numbers that stand at any byte, as the fields of a message do. */
#ifndef VIAPOINT_LOOSE_H
#define VIAPOINT_LOOSE_H

#if defined(__GNUC__)
#define LOOSE __attribute__((aligned(1)))
#else
#define LOOSE
#endif

typedef double LOOSE loose_double;
typedef int LOOSE loose_int;

#endif
