// The cubic spline without a branch, of a number or of several at once: 2 (1 - q)^3 less 8 (1/2 - q)^3 where those are positive.
#define SPLINE(Number) \
    Number spline(Number q) { \
        Number far = max(1.0 - q, 0.0), near = max(0.5 - q, 0.0); \
        return 2.0 * far * far * far - 8.0 * near * near * near; \
    }
