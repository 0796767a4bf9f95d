// Each channel's linear light to its code, rounded to levels.

uniform Real3 lift;
uniform Real3 scale;              // 1 / (1 - lift)
uniform float levels;             // 255 rounds to codes of 8 bits; 0 leaves them as they are

float code_of_light(int channel, Real light);

vec4 codes_of_linear(Real3 asked) {
    Real3 light = mul(sub(limit(asked, 0.0, 1.0), lift), scale);
    vec3 code = vec3(code_of_light(0, channel_of(light, 0)), code_of_light(1, channel_of(light, 1)),
                     code_of_light(2, channel_of(light, 2)));
    code = clamp(code, 0.0, 1.0);
    return vec4(levels > 0.0 ? floor(code * levels + 0.5) / levels : code, 1.0);
}
