// A picture's codes, one texel to one pixel.

uniform sampler2D picture_codes;  // top row first
uniform ivec2 corner_px;          // the picture's top left pixel, in window coordinates (y upwards)

out vec4 pixel;

void main() {
    ivec2 place = ivec2(gl_FragCoord.xy);
    pixel = texelFetch(picture_codes, ivec2(place.x - corner_px.x, corner_px.y - place.y), 0);
}
