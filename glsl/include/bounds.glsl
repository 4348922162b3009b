// Bounds of the body's depth at a pixel, both such that less is tighter and that nothing is certain where they are infinite:
// the front map's largest depth, and how far its back map's smallest lies before infinity, as bits of floats (integer order
// equals float order for positive ones).
const uint INFINITE = 0x7f800000u;

uint front_bound(float depth) { return floatBitsToUint(depth); }
uint back_bound(float depth) { return INFINITE - floatBitsToUint(depth); }
