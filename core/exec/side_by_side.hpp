// Before a loop of a few iterations that a host is to do side by side, in a register: a compiler
// that writes it out first no longer sees that it could. Without meaning on a device.
#pragma once

#if defined(__GNUC__) && !defined(__CUDACC__)
#define TAUT_SIDE_BY_SIDE _Pragma("GCC unroll 1")
#else
#define TAUT_SIDE_BY_SIDE
#endif
