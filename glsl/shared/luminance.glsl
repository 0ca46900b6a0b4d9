// Luminance of linear RGB (Rec. 709).
#ifndef LUMIVOX_LUMINANCE
#define LUMIVOX_LUMINANCE

float luminance_of(vec3 rgb) {
    return dot(rgb, vec3(0.2126, 0.7152, 0.0722));
}

#endif
