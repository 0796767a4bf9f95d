// The inverse tone curve of a table of codes and light, piece by piece, in place of table_fourth_root.glsl. Which
// piece, and where in it, is found in Reals, because a curve may be nearly flat. The NumPy twin is
// devices.display.knot_table.knot_codes.

uniform sampler2D knots;          // row = channel, two texels a piece: root of light in two parts, its rise, code where it
                                  // begins; a, b, c, the code's rise

float code_by_knots(int channel, Real light) {
    Real root_of_light = root(light);
    int low = 0;
    int high = textureSize(knots, 0).x / 2 - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        vec2 begin = texelFetch(knots, ivec2(2 * middle, channel), 0).rg;
        if (at_most(real(begin.r, begin.g), root_of_light)) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    vec4 piece = texelFetch(knots, ivec2(2 * low, channel), 0);
    vec4 cubic = texelFetch(knots, ivec2(2 * low + 1, channel), 0);
    float wanted = clamp(float_of(sub(root_of_light, real(piece.r, piece.g))) / piece.b, 0.0, 1.0);
    float below = 0.0;
    float above = 1.0;
    float u = wanted;
    for (int i = 0; i < 24; i++) {
        float value = ((cubic.r * u + cubic.g) * u + cubic.b) * u;
        float slope = (3.0 * cubic.r * u + 2.0 * cubic.g) * u + cubic.b;
        if (value > wanted) {
            above = u;
        } else {
            below = u;
        }
        float next = slope > 0.0 ? u - (value - wanted) / slope : -1.0;
        if (!(next >= below && next <= above)) {
            next = 0.5 * (below + above);
        }
        bool done = abs(next - u) < 2e-7;
        u = next;
        if (done) {
            break;
        }
    }
    return piece.a + cubic.a * u;
}
