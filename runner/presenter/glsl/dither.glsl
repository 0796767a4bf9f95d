// Each channel's linear light to one of the two codes around it, the upper where the mask is below
// p = (light - y_k) / (y_(k+1) - y_k), so that the mean light of a mask period is the light asked for.
// In place of encode.glsl. The NumPy twin is devices.compensation.dither.tabled_dither_codes.

uniform Real3 lift;
uniform Real3 scale;              // 1 / (1 - lift)
uniform sampler2D code_lights;    // light of codes 0..levels, row = channel
uniform usampler2D dither_mask;   // ranks 0..4095, 64 x 64
uniform ivec2 mask_shifts_px[3];  // where each channel starts in the mask
uniform int height_px;            // of the framebuffer: OpenGL counts rows from below

float code_of_light(int channel, Real light);

float dithered_code(int channel, float light) {
    int levels = textureSize(code_lights, 0).x - 1;
    int lower = clamp(int(floor(code_of_light(channel, real(light)) * float(levels))), 0, levels - 1);
    float low = texelFetch(code_lights, ivec2(lower, channel), 0).r;
    float high = texelFetch(code_lights, ivec2(lower + 1, channel), 0).r;
    // The table of codes may err across the boundary of a code; the light of the codes decides.
    if (light < low && lower > 0) {
        lower--;
        high = low;
        low = texelFetch(code_lights, ivec2(lower, channel), 0).r;
    } else if (light >= high && lower < levels - 1) {
        lower++;
        low = high;
        high = texelFetch(code_lights, ivec2(lower + 1, channel), 0).r;
    }
    ivec2 place = ivec2(int(gl_FragCoord.x), height_px - 1 - int(gl_FragCoord.y));
    uint rank = texelFetch(dither_mask, (place + mask_shifts_px[channel]) & 63, 0).r;
    // u < p, without the division: how exact that is, each driver decides, and two codes may have the same light.
    float threshold = (float(rank) + 0.5) / 4096.0;
    bool upper = threshold * (high - low) < light - low;
    return float(upper ? lower + 1 : lower) / float(levels);
}

vec4 codes_of_linear(Real3 asked) {
    vec3 light = max(floats_of(mul(sub(limit(asked, 0.0, 1.0), lift), scale)), vec3(0.0));
    return vec4(dithered_code(0, light.r), dithered_code(1, light.g), dithered_code(2, light.b), 1.0);
}
