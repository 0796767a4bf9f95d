// The numbers that colours are computed in, as 64-bit floats: where the driver has them (GL_ARB_gpu_shader_fp64).
// arithmetic_two_float.glsl has the same types and functions for all others; a pass is written once, in these:
//
//   Real, Real3, Real3x3           a number, one for each channel, a matrix of columns. As uniforms they are set by
//                                  runner.presenter.shaders.set_uniform from Real3(...) and Real3x3(...).
//   real(x), real3(v)              from floats, exactly; real(high, low), real3(high, low): the sum of two floats
//   real3(r, g, b)                 from three Reals
//   float_of(a), floats_of(a)      the nearest floats
//   channel_of(a, i)               one of a Real3
//   add, sub, mul, div             two Reals, two Real3s, channel by channel, or a Real3 and a Real; the second may be
//                                  floats, which costs less
//   mul(M, a)                      a matrix times a Real3, exact but for the last rounding
//   root(a)                        the square root; 0 below 0
//   limit(a, low, high)            clamped, to Real3s or to floats
//   at_most(a, b)                  a <= b
//
// There is no `a + b` of Reals: two floats are a struct, and the compiler refuses it. Never take what add or mul
// gives apart, or compute with `.high` alone where a difference of large numbers follows.

#define Real double
#define Real3 dvec3
#define Real3x3 dmat3

Real real(float x) { return Real(x); }
Real real(float high, float low) { return Real(high) + Real(low); }
Real3 real3(vec3 v) { return Real3(v); }
Real3 real3(vec3 high, vec3 low) { return Real3(high) + Real3(low); }
Real3 real3(Real r, Real g, Real b) { return Real3(r, g, b); }
float float_of(Real a) { return float(a); }
vec3 floats_of(Real3 a) { return vec3(a); }
Real channel_of(Real3 a, int channel) { return a[channel]; }

Real add(Real a, Real b) { return a + b; }
Real3 add(Real3 a, Real3 b) { return a + b; }
Real sub(Real a, Real b) { return a - b; }
Real3 sub(Real3 a, Real3 b) { return a - b; }
Real mul(Real a, Real b) { return a * b; }
Real3 mul(Real3 a, Real b) { return a * b; }
Real3 mul(Real3 a, Real3 b) { return a * b; }
Real3 mul(Real3x3 matrix, Real3 a) { return matrix * a; }
Real div(Real a, Real b) { return a / b; }
Real3 div(Real3 a, Real b) { return a / b; }
Real root(Real a) { return sqrt(max(a, Real(0.0))); }
Real3 root(Real3 a) { return sqrt(max(a, Real3(0.0))); }
Real limit(Real a, float low, float high) { return clamp(a, Real(low), Real(high)); }
Real3 limit(Real3 a, float low, float high) { return clamp(a, Real(low), Real(high)); }
Real3 limit(Real3 a, Real3 low, Real3 high) { return clamp(a, low, high); }
bool at_most(Real a, Real b) { return a <= b; }
