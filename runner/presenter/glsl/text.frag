// Words from their coverage. `ink` holds the codes of that coverage's share of the ink's light, so that an edge on
// black is smooth in linear light; blended as ink + (1 - coverage) · what lies below.

uniform sampler2D coverage;       // top row first
uniform sampler2D ink;            // 256 codes, by coverage
uniform ivec2 corner_px;          // the words' top left pixel, in window coordinates (y upwards)

out vec4 pixel;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    float share = texelFetch(coverage, ivec2(place.x - corner_px.x, corner_px.y - place.y), 0).r;
    pixel = vec4(texelFetch(ink, ivec2(int(share * 255.0 + 0.5), 0), 0).rgb, share);
}
