// The inverse tone curve from a table over the fourth root of light: row = channel, linear between entries.
// texelFetch and our own interpolation, because hardware filtering has 8 fraction bits.

uniform sampler2D code_table;

float code_by_table(int channel, Real asked) {
    float light = max(float_of(asked), 0.0);
    int last = textureSize(code_table, 0).x - 1;
    float place = sqrt(sqrt(light)) * float(last);
    int below = clamp(int(place), 0, last - 1);
    float low = texelFetch(code_table, ivec2(below, channel), 0).r;
    float high = texelFetch(code_table, ivec2(below + 1, channel), 0).r;
    return low + (high - low) * (place - float(below));
}
