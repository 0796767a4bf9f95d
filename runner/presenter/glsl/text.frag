// Words from their coverage. `ink` holds the codes of that coverage's share of the ink's light, so that an edge on
// black is smooth in linear light; blended as ink + (1 - coverage) · what lies below.

uniform sampler2D coverage;       // top row first
uniform sampler2D ink;            // 256 codes, by coverage
uniform ivec2 origin;             // texel = origin + direction · pixel (y upwards)
uniform ivec2 direction;

out vec4 pixel;

void only_my_pixels();

void main() {
    only_my_pixels();
    float share = texelFetch(coverage, origin + direction * ivec2(gl_FragCoord.xy), 0).r;
    pixel = vec4(texelFetch(ink, ivec2(int(share * 255.0 + 0.5), 0), 0).rgb, share);
}
