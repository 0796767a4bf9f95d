// The inverse tone curve of a table of codes and light, piece by piece, in place of table_fourth_root.glsl where channels
// act on each other. The NumPy twin is devices.knot_table.knot_codes.

uniform sampler2D knots;          // row = channel, two texels a piece: root of light, its rise, code, its rise; a, b, c

float code_of_light(int channel, float light) {
    float root = sqrt(light);
    int low = 0;
    int high = textureSize(knots, 0).x / 2 - 1;
    while (low < high) {
        int middle = (low + high + 1) / 2;
        if (texelFetch(knots, ivec2(2 * middle, channel), 0).r <= root) {
            low = middle;
        } else {
            high = middle - 1;
        }
    }
    vec4 piece = texelFetch(knots, ivec2(2 * low, channel), 0);
    vec3 cubic = texelFetch(knots, ivec2(2 * low + 1, channel), 0).rgb;
    float wanted = clamp((root - piece.r) / piece.g, 0.0, 1.0);
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
        bool done = abs(next - u) < 3e-8;
        u = next;
        if (done) {
            break;
        }
    }
    return piece.b + piece.a * u;
}
