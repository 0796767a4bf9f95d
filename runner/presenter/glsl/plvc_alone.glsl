// No residual; see plvc_residual.glsl.

Real3 add_residual(int eye, Real3 T, Real3 light, inout mat3 slopes) { return light; }
