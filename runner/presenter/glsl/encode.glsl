// Each channel's linear light to its code, rounded to levels.

uniform Real3 lift;
uniform Real3 scale;              // 1 / (1 - lift)
uniform float levels;             // 255 rounds to codes of 8 bits; 0 leaves them as they are

float code_of_light(int channel, Real light);

vec4 codes_of_linear(Real3 asked) {
    Real3 light = mul(sub(limit(asked, 0.0, 1.0), lift), scale);
    vec3 code;
    for (int channel = 0; channel < 3; channel++) {
        code[channel] = code_of_light(channel, channel_of(light, channel));
    }
    code = clamp(code, 0.0, 1.0);
    return vec4(levels > 0.0 ? floor(code * levels + 0.5) / levels : code, 1.0);
}
