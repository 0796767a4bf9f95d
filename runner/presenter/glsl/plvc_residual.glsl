// What a model of channels that act on each other leaves over: kernels at knots, added to its light and its slopes. The
// NumPy twin is devices.display.residual.kernels_and_slopes.

uniform sampler2D plvc_residual;  // row = eye (own, other); four texels a knot: its place and 1 / width, what these lack
                                  // as floats, its light, and what that lacks; last, in place of a knot, the light at black

Real3 add_residual(int eye, Real3 T, Real3 light, inout mat3 slopes) {
    Real3 roots = root(add(T, vec3(0.015625)));
    Real3 place = sub(roots, vec3(0.125));
    vec3 by_light = 0.5 / floats_of(roots);
    int last = textureSize(plvc_residual, 0).x / 4 - 1;
    for (int knot = 0; knot < last; knot++) {
        vec4 high = texelFetch(plvc_residual, ivec2(4 * knot, eye), 0);
        vec4 low = texelFetch(plvc_residual, ivec2(4 * knot + 1, eye), 0);
        Real3 off = sub(place, real3(high.xyz, low.xyz));
        Real3 squares = mul(off, off);
        Real square = add(add(channel_of(squares, 0), channel_of(squares, 1)), channel_of(squares, 2));
        Real distance_in_widths = mul(root(square), real(high.w, low.w));
        Real near = sub(real(1.0), distance_in_widths);
        float near_float = float_of(near);
        if (near_float > 0.0) {
            vec3 own = texelFetch(plvc_residual, ivec2(4 * knot + 2, eye), 0).xyz;
            vec3 rest = texelFetch(plvc_residual, ivec2(4 * knot + 3, eye), 0).xyz;
            Real near_2 = mul(near, near);
            Real kernel = mul(mul(near_2, near_2), add(mul(distance_in_widths, 4.0), 1.0));
            light = add(light, mul(real3(own, rest), kernel));
            vec3 falls = -20.0 * high.w * high.w * near_float * near_float * near_float * floats_of(off) * by_light;
            slopes[0] += falls.r * own;
            slopes[1] += falls.g * own;
            slopes[2] += falls.b * own;
        }
    }
    vec3 black = texelFetch(plvc_residual, ivec2(4 * last + 2, eye), 0).xyz;
    vec3 black_rest = texelFetch(plvc_residual, ivec2(4 * last + 3, eye), 0).xyz;
    return sub(light, real3(black, black_rest));
}
