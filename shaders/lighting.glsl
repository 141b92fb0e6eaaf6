// Two directional lights and a sky. What reaches a point of them is `light_at`, see light_volume.glsl.

uniform vec3 u_key_direction;   // towards the light, head frame, unit
uniform vec3 u_key_colour;
uniform vec3 u_rim_direction;
uniform vec3 u_rim_colour;
uniform vec3 u_sky_colour;
uniform vec3 u_ground_colour;

vec3 ambient(float up) { return mix(u_ground_colour, u_sky_colour, 0.5 + 0.5 * up); }
