/*
 * meniscus: particle liquids with complex refractions, recorded into your own Vulkan command buffer.
 *
 * Made by cbindgen from the sources of capi/src. Do not edit: change them, and then
 *     MENISCUS_BLESS=1 cargo test -p meniscus-capi --test capi header
 *
 * The renderer borrows the host's instance and device. It creates no device, submits nothing, waits for nothing and presents
 * nothing; it needs Vulkan 1.3 with dynamicRendering and synchronization2 enabled (meniscus_required_features), and one queue
 * family with graphics and compute.
 *
 * - Frames are submitted to one queue in the order they were recorded. Before the host records into a slot again, the frame last
 *   recorded into it has completed. A frame that was recorded and never runs is said to be so with meniscus_renderer_abandon.
 * - The output image is in COLOR_ATTACHMENT_OPTIMAL before and after, or in MeniscusFrame::output_layout. The host makes it available
 *   before, and visible afterwards.
 * - Structs begin with their size: set struct_size to sizeof the struct, and all that is not needed to 0, which stands for what is
 *   usual. Programs run with later libraries as they are, and with earlier ones unless they ask for what those do not know.
 * - Objects are made with ..._create, ..._copy or meniscus_prepare, and destroyed with ..._destroy; null is destroyed as nothing.
 *   Different threads may use different objects at a time; what several may share says so.
 * - Functions give a MeniscusStatus, 0 where all went well, and below 0 an error; meniscus_last_message has its text, in UTF-8, for
 *   the calling thread. Nothing is thrown, and no panic leaves the library: it is MENISCUS_STATUS_ERROR_PANIC, and a line on stderr.
 * - After an error, what functions write is as it was, but for objects, which are null.
 * - World units are the scene's own. Eye space is right-handed and looks down -z. Colours are linear.
 *
 * MIT or Apache-2.0, at your choice.
 */

#ifndef MENISCUS_H
#define MENISCUS_H

#include <stddef.h>
#include <stdint.h>
#include <vulkan/vulkan.h>

/**
 * Version of this interface. It changes when a program would have to be compiled anew; structs that grow do not change it.
 */
#define MENISCUS_ABI_VERSION 1

/**
 * MeniscusMemoryRequest::location: on the device, DEVICE_LOCAL where there is such memory.
 */
#define MENISCUS_LOCATION_DEVICE 0

/**
 * MeniscusMemoryRequest::location: where the host writes and the device reads: HOST_VISIBLE and HOST_COHERENT, and mapped.
 */
#define MENISCUS_LOCATION_UPLOAD 1

/**
 * MeniscusFrame::background: the environment, and before it the scene. Every pixel of the output is written, with alpha 1.
 */
#define MENISCUS_BACKGROUND_ENVIRONMENT 0

/**
 * MeniscusFrame::background: the host's own picture, which the output holds. Only pixels that show liquid are written, with
 * alpha 1. Rays that meet nothing take the scene's colour where its depth is cleared in the direction they go.
 */
#define MENISCUS_BACKGROUND_HOST 1

/**
 * MeniscusEnvironment::shape: a 2D view, equirectangular: the first row is straight up, columns run once around.
 */
#define MENISCUS_ENVIRONMENT_EQUIRECT 0

/**
 * MeniscusEnvironment::shape: a cube view.
 */
#define MENISCUS_ENVIRONMENT_CUBE 1

/**
 * MeniscusFrame::eye_inside: the eye is outside the body.
 */
#define MENISCUS_EYE_OUTSIDE 0

/**
 * MeniscusFrame::eye_inside: it is inside, where meniscus_density_at gives half at least, say. VK_TRUE is the same.
 */
#define MENISCUS_EYE_INSIDE 1

/**
 * MeniscusFrame::eye_inside: the device finds out, by the same measure, of MeniscusFrame::positions as they are when the frame runs.
 * With particles that the host prepared a method that has to know is an error.
 */
#define MENISCUS_EYE_ON_DEVICE 2

/**
 * meniscus_list: methods, for meniscus_settings_preset. The first is the default.
 */
#define MENISCUS_LIST_PRESETS 0

/**
 * meniscus_list: members of the family "layers".
 */
#define MENISCUS_LIST_LAYERS 1

/**
 * meniscus_list: members of the family "smooth".
 */
#define MENISCUS_LIST_SMOOTH 2

/**
 * meniscus_list: members of the family "optics".
 */
#define MENISCUS_LIST_OPTICS 3

/**
 * A class of particles: an isolated droplet, drawn as a ball.
 */
#define MENISCUS_CLASS_SPLASH 0

/**
 * A class of particles: part of the liquid body.
 */
#define MENISCUS_CLASS_BODY 1

/**
 * What meniscus_settings_parameter tells of one: the name.
 */
#define MENISCUS_PARAMETER_NAME 0

/**
 * What it is.
 */
#define MENISCUS_PARAMETER_DOC 1

/**
 * Unit of the value that it has; empty where it has none.
 */
#define MENISCUS_PARAMETER_UNIT 2

/**
 * What it must be, as in "use ...".
 */
#define MENISCUS_PARAMETER_RANGE 3

/**
 * Words to choose from, with commas between; empty if any value of the range will do.
 */
#define MENISCUS_PARAMETER_CHOICES 4

/**
 * Value it has when nothing is said.
 */
#define MENISCUS_PARAMETER_DEFAULT 5

/**
 * Value it has.
 */
#define MENISCUS_PARAMETER_VALUE 6

/**
 * How a call ended. Numbers never change; there may be more of them in later versions: errors are below 0.
 */
enum MeniscusStatus
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    /**
     * Done.
     */
    MENISCUS_STATUS_OK = 0,
    /**
     * Not there yet: ask again later. No error.
     */
    MENISCUS_STATUS_NOT_READY = 1,
    /**
     * The device lacks something that every frame needs.
     */
    MENISCUS_STATUS_ERROR_UNSUPPORTED = -1,
    /**
     * A Vulkan call failed: see meniscus_last_vk_result.
     */
    MENISCUS_STATUS_ERROR_VULKAN = -2,
    /**
     * Device memory could not be had.
     */
    MENISCUS_STATUS_ERROR_MEMORY = -3,
    /**
     * The frame takes more memory than the device has; nothing was allocated.
     */
    MENISCUS_STATUS_ERROR_MEMORY_SHORT = -4,
    /**
     * A parameter, size, count, handle or name is not what it has to be.
     */
    MENISCUS_STATUS_ERROR_PARAMETER = -5,
    /**
     * A pass declares what cannot be: a mistake in meniscus. Please report it.
     */
    MENISCUS_STATUS_ERROR_PASS = -6,
    /**
     * Calls came in an order that cannot be.
     */
    MENISCUS_STATUS_ERROR_ORDER = -7,
    /**
     * What was given is no proper argument: a null pointer, a struct's size, text that is not UTF-8.
     */
    MENISCUS_STATUS_ERROR_ARGUMENT = -8,
    /**
     * meniscus panicked: a mistake in it. Please report it. The object is good for nothing but to be destroyed.
     */
    MENISCUS_STATUS_ERROR_PANIC = -9,
    /**
     * Another error; its message says which.
     */
    MENISCUS_STATUS_ERROR_OTHER = -10,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum MeniscusStatus MeniscusStatus;
#else
typedef int32_t MeniscusStatus;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

/**
 * Picks among methods, the best first, the best one whose frames take no longer than they may. One thread at a time uses it.
 */
typedef struct MeniscusAuto MeniscusAuto;

/**
 * How dense the liquid is anywhere. Any number of threads may read it.
 */
typedef struct MeniscusDensity MeniscusDensity;

/**
 * Particles, prepared; for any renderer. Any number of threads may read it.
 */
typedef struct MeniscusPrepared MeniscusPrepared;

/**
 * Renders particle liquids into a host's command buffers. One thread at a time uses it.
 */
typedef struct MeniscusRenderer MeniscusRenderer;

/**
 * Method, liquid, drawing, and how particles are prepared. One thread at a time changes it; any number may read it.
 */
typedef struct MeniscusSettings MeniscusSettings;

/**
 * A perspective camera, as it is drawn with: the picture's upper left corner is (-1, -1) in Vulkan's clip space. Matrices are
 * column by column, and multiply column vectors.
 *
 * Left-handed worlds: `view` may mirror. An eye space that looks along +z, with w = +z, becomes this one by
 * F = diag(1, 1, -1, 1): projection p * F, view F * v. Viewports of negative height turn y around after the projection: negate
 * `projection`'s second row.
 */
typedef struct {
    /**
     * sizeof(MeniscusCamera).
     */
    size_t struct_size;
    /**
     * World to eye: a rotation, with or without a reflection, and a translation.
     */
    float view[16];
    /**
     * Eye to Vulkan clip space (y down), perspective: w = -z. May be off-centre, jittered, reversed or infinite.
     */
    float projection[16];
    /**
     * Distance from the eye along the view axis, above 0, before which no liquid is drawn. It need not be the projection's near
     * plane.
     */
    float near_distance;
    /**
     * World direction in which the environment's +y points. Three zeros stand for +y.
     */
    float up[3];
    /**
     * Angle by which the environment is turned around `up`, in radians, counter-clockwise as seen from above.
     */
    float environment_rotation;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusCamera;

/**
 * Positions in device memory, prepared within the frame that draws them: neighbours, classes, shapes, with no word about them to
 * the host. How says the frame's settings (support, splash_threshold and so on).
 *
 * The buffers have usage STORAGE_BUFFER, and their writes are visible to reads in compute shaders before the frame, which only
 * reads them.
 */
typedef struct {
    /**
     * sizeof(MeniscusPositions).
     */
    size_t struct_size;
    /**
     * Three 32-bit floats a particle, in world units. A position that is not finite is left out.
     */
    VkBuffer buffer;
    /**
     * Where the first one begins, in bytes; a multiple of 4.
     */
    VkDeviceSize offset;
    /**
     * Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
     */
    VkDeviceSize stride;
    /**
     * How many there are; with count_buffer how many there may be.
     */
    uint32_t count;
    /**
     * Particle radius in world units: half the rest spacing.
     */
    float radius;
    /**
     * Hysteresis against popping: a particle keeps the class that the last frame gave it while its density lies between the
     * setting splash_threshold and this share of a filled body's; a tenth above the threshold is plenty. 0 stands for none.
     */
    float keep_class_below;
    /**
     * How many ids there may be: all are below this. 0 stands for no ids: then particles go by their place in the buffer.
     */
    uint32_t id_number;
    /**
     * One id of 32 bits a particle, for keep_class_below: needed where the simulation re-sorts its particles, or their number
     * changes. It may be the buffer of the positions.
     */
    VkBuffer id_buffer;
    /**
     * Where the first id begins, in bytes; a multiple of 4.
     */
    VkDeviceSize id_offset;
    /**
     * Bytes from one id to the next; a multiple of 4. 0 stands for 4.
     */
    VkDeviceSize id_stride;
    /**
     * How many particles there are, where only the device knows: 32 bits, read when the frame runs; or VK_NULL_HANDLE. What lies
     * behind so many is not there, whatever it holds. It may be the buffer of the positions.
     */
    VkBuffer count_buffer;
    /**
     * Where that number lies, in bytes; a multiple of 4.
     */
    VkDeviceSize count_offset;
} MeniscusPositions;

/**
 * The host's opaque scene, rendered before the liquid at the same size and with the same camera, of one sample a pixel: what was
 * multisampled is resolved before, its depth by one of its samples. It hides liquid, is seen through
 * it, and ends rays under water. Both images are sampled in the fragment stage.
 */
typedef struct {
    /**
     * sizeof(MeniscusScene).
     */
    size_t struct_size;
    /**
     * Linear colour.
     */
    VkImageView color;
    /**
     * Depth buffer (depth aspect) of the camera's projection.
     */
    VkImageView depth;
    /**
     * Layout the colour is in, before and after.
     */
    VkImageLayout color_layout;
    /**
     * Layout the depth is in, before and after.
     */
    VkImageLayout depth_layout;
    /**
     * Depth value where nothing was drawn: 1, or 0 with reversed depths.
     */
    float cleared_depth;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Where the view begins in both, in pixels: they may be larger than it.
     */
    uint32_t origin[2];
} MeniscusScene;

/**
 * An environment of the host's own, in place of the one that the renderer was given: linear light, infinitely far away, sampled in
 * the fragment stage.
 */
typedef struct {
    /**
     * sizeof(MeniscusEnvironment).
     */
    size_t struct_size;
    /**
     * Of any format that reads as floats; mip level 0 is used.
     */
    VkImageView view;
    /**
     * Layout it is in, before and after.
     */
    VkImageLayout layout;
    /**
     * MENISCUS_ENVIRONMENT_...
     */
    uint32_t shape;
} MeniscusEnvironment;

/**
 * Motion vectors of the first surface: where each pixel's surface was in the frame before, less where it is, in parts of the
 * picture's width and height, y down, both without jitter (FSR and DLSS: scale them by the size in pixels). It moves with the
 * camera, and as the particle nearest to it does.
 */
typedef struct {
    /**
     * sizeof(MeniscusMotion).
     */
    size_t struct_size;
    /**
     * Where they go: R16G16_SFLOAT, R32G32_SFLOAT, or with two more components, which become 0.
     */
    VkImageView output;
    /**
     * Format of the output's view.
     */
    VkFormat output_format;
    /**
     * Layout the output is in, before and after: one in which it can be attached.
     */
    VkImageLayout output_layout;
    /**
     * World to eye of the frame before, column by column.
     */
    float previous_view[16];
    /**
     * The frame before's projection, without its jitter.
     */
    float previous_projection[16];
    /**
     * This frame's projection, without its jitter.
     */
    float projection[16];
    /**
     * Particles that move: three 32-bit floats each, in world units. Read in vertex shaders, as `before`.
     */
    VkBuffer positions;
    /**
     * Where the first one begins, in bytes; a multiple of 4.
     */
    VkDeviceSize position_offset;
    /**
     * Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
     */
    VkDeviceSize position_stride;
    /**
     * Their velocities, in world units a second; or where they were in the frame before, if `seconds` is 0.
     */
    VkBuffer before;
    /**
     * Where the first one begins, in bytes; a multiple of 4.
     */
    VkDeviceSize before_offset;
    /**
     * Bytes from one to the next; a multiple of 4, at least 12. 0 stands for 12.
     */
    VkDeviceSize before_stride;
    /**
     * How many particles, with count_buffer how many there may be; 0: the liquid stands still, and only the camera moves.
     */
    uint32_t count;
    /**
     * Seconds since the frame before, that velocities count for; 0 where `before` holds positions.
     */
    float seconds;
    /**
     * How many particles there are, where only the device knows: 32 bits; or VK_NULL_HANDLE. Read in vertex shaders.
     */
    VkBuffer count_buffer;
    /**
     * Where that number lies, in bytes; a multiple of 4.
     */
    VkDeviceSize count_offset;
} MeniscusMotion;

/**
 * What a frame says of the first surface that each pixel shows, the one that the picture has, into images of the host's: loaded,
 * written where liquid shows, stored. Where none shows they keep what they hold. They are of one sample and of the output's size. An
 * eye in the liquid sees it from the near plane on, which is then the surface, facing the eye.
 */
typedef struct {
    /**
     * sizeof(MeniscusSurface).
     */
    size_t struct_size;
    /**
     * Its depth as the camera's projection has it, clamped to 0..1; or null. Of a format with depth, as a depth attachment that is
     * written without a test: the host's own depth buffer, say, if the scene that this frame samples is another image. Or of
     * R32_SFLOAT.
     */
    VkImageView depth;
    /**
     * Its unit normal in world space, towards the eye's side; or null. As it is in RGBA formats that hold signs
     * (R32G32B32A32_SFLOAT, R16G16B16A16_SFLOAT, R16G16B16A16_SNORM, R8G8B8A8_SNORM), as (n + 1) / 2 in others
     * (A2B10G10R10_UNORM_PACK32, R16G16B16A16_UNORM, R8G8B8A8_UNORM); alpha is 1.
     */
    VkImageView normal;
    /**
     * Format of the depth's view.
     */
    VkFormat depth_format;
    /**
     * Layout the depth is in, before and after: one in which it can be attached.
     */
    VkImageLayout depth_layout;
    /**
     * Format of the normal's view.
     */
    VkFormat normal_format;
    /**
     * Layout the normal is in, before and after: one in which it can be attached.
     */
    VkImageLayout normal_layout;
    /**
     * How it has moved since the frame before; or null.
     */
    const MeniscusMotion *motion;
    /**
     * A mask that says how little of the pixel's history a temporal upscaler may keep (FSR: reactive, DLSS: bias of the current
     * colour); or null. R8_UNORM, R16_SFLOAT or R32_SFLOAT.
     */
    VkImageView reactive;
    /**
     * Format of the mask's view.
     */
    VkFormat reactive_format;
    /**
     * Layout the mask is in, before and after: one in which it can be attached.
     */
    VkImageLayout reactive_layout;
    /**
     * What the mask says where liquid shows, 0 to 1; FSR advises 0.9 at most.
     */
    float reactive_value;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusSurface;

/**
 * One frame. Pointers are read before the call returns.
 */
typedef struct {
    /**
     * sizeof(MeniscusFrame).
     */
    size_t struct_size;
    /**
     * Camera.
     */
    const MeniscusCamera *camera;
    /**
     * Method, liquid, drawing; and how positions on the device are prepared.
     */
    const MeniscusSettings *settings;
    /**
     * Of one sample, of the format that the renderer was given, and at least of its size.
     */
    VkImageView output;
    /**
     * Which of the frames in flight this is: below MeniscusHost::frames_in_flight.
     */
    uint32_t slot;
    /**
     * MENISCUS_BACKGROUND_...
     */
    uint32_t background;
    /**
     * Positions on the device, drawn instead of the particles last given; or null.
     */
    const MeniscusPositions *positions;
    /**
     * The host's opaque scene; or null.
     */
    const MeniscusScene *scene;
    /**
     * The host's own environment; or null for the one that the renderer was given.
     */
    const MeniscusEnvironment *environment;
    /**
     * VK_TRUE if the particles are those of the frame recorded before and have not moved since: then what follows from them alone is
     * kept.
     */
    VkBool32 still;
    /**
     * MENISCUS_EYE_...: whether the eye is inside the body; every ray then starts in it. A density field knows by itself.
     */
    uint32_t eye_inside;
    /**
     * What later passes are told of the first surface; or null.
     */
    const MeniscusSurface *surface;
    /**
     * Where the view begins in the output and in the images of `surface`, in pixels: they may be larger than it. What is beside it
     * stays as it is.
     */
    uint32_t origin[2];
    /**
     * Layout the output is in, before and after: COLOR_ATTACHMENT_OPTIMAL, ATTACHMENT_OPTIMAL or GENERAL. 0 stands for the first.
     */
    VkImageLayout output_layout;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusFrame;

/**
 * One frame of particles, in world units, in the host's memory. Arrays are read before the call returns.
 */
typedef struct {
    /**
     * sizeof(MeniscusParticles).
     */
    size_t struct_size;
    /**
     * Centres: three floats each.
     */
    const float *positions;
    /**
     * How many particles there are.
     */
    size_t count;
    /**
     * Particle radius: half the rest spacing.
     */
    float radius;
    /**
     * Below what share of a filled body's density the classes were kept (meniscus_classify's `upper`), or 0.
     */
    float keep_class_below;
    /**
     * Velocities, three floats each, in world units a second; or null. For spray.
     */
    const float *velocities;
    /**
     * Classes (MENISCUS_CLASS_...), one byte each, to use instead of the threshold's; or null.
     */
    const uint8_t *classes;
    /**
     * Semi-axes, three vectors of three floats each, to use instead of fitted ones for particles of the body; or null.
     */
    const float *axes;
    /**
     * VK_TRUE to leave out what only a density field needs (layers "field", the default).
     */
    VkBool32 without_points;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusParticles;

/**
 * How many particles went which way.
 */
typedef struct {
    /**
     * sizeof(MeniscusReport).
     */
    size_t struct_size;
    /**
     * Particles drawn as splash.
     */
    size_t splash;
    /**
     * Particles drawn as body.
     */
    size_t body;
    /**
     * Of the body, left spheres for want of neighbours.
     */
    size_t few_neighbours;
    /**
     * Of the body, left spheres because their neighbours coincide.
     */
    size_t degenerate;
    /**
     * Of the body, cut to the longest semi-axis.
     */
    size_t clamped_long;
    /**
     * Of the body, thickened to the shortest semi-axis, or to the largest ratio.
     */
    size_t clamped_ratio;
    /**
     * Splashes that came with an ellipsoid other than the ball they are drawn as.
     */
    size_t splash_axes_ignored;
} MeniscusReport;

/**
 * Memory that the renderer asks for.
 */
typedef struct {
    /**
     * sizeof(MeniscusMemoryRequest), of the library's version.
     */
    size_t struct_size;
    /**
     * What for, for debuggers; it ends with a 0, and is there until the call returns.
     */
    const char *name;
    /**
     * Size in bytes at least, as Vulkan has said it.
     */
    VkDeviceSize size;
    /**
     * What its offset has to be a multiple of.
     */
    VkDeviceSize alignment;
    /**
     * Types that will do, one bit each (VkMemoryRequirements::memoryTypeBits).
     */
    uint32_t memory_type_bits;
    /**
     * MENISCUS_LOCATION_...
     */
    uint32_t location;
    /**
     * VK_TRUE where a buffer is bound to it, or else an optimally tiled image: of one allocation they lie bufferImageGranularity apart.
     */
    VkBool32 linear;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusMemoryRequest;

/**
 * A piece of device memory that one resource is bound to.
 */
typedef struct {
    /**
     * What it is a part of.
     */
    VkDeviceMemory memory;
    /**
     * Where it begins there, in bytes.
     */
    VkDeviceSize offset;
    /**
     * Its first byte as the host sees it; of MENISCUS_LOCATION_UPLOAD alone.
     */
    void *mapped;
    /**
     * Whatever the allocator wants to have back with it.
     */
    void *own;
} MeniscusAllocation;

/**
 * Fills an allocation, which comes as zeros, and gives VK_SUCCESS; or says why there is no memory.
 */
typedef VkResult (*PFN_meniscusAllocate)(void *user_data, const MeniscusMemoryRequest *request, MeniscusAllocation *allocation);

/**
 * Takes an allocation back as it was given, which no frame uses any more.
 */
typedef void (*PFN_meniscusFree)(void *user_data, const MeniscusAllocation *allocation);

/**
 * An allocator of device memory. It is called by calls that make, record or destroy something, on their threads: by those of
 * several renderers at a time, if it serves several. What it gives is memory of the renderer's device, of a type that the request
 * allows, aligned, and nobody else's, until it is taken back; where that is mapped, all of it can be written without flushes.
 * It does not throw, and does not jump out.
 */
typedef struct {
    /**
     * sizeof(MeniscusAllocator).
     */
    size_t struct_size;
    /**
     * Given to both functions.
     */
    void *user_data;
    /**
     * Memory, or why there is none.
     */
    PFN_meniscusAllocate allocate;
    /**
     * Takes it back.
     */
    PFN_meniscusFree free;
} MeniscusAllocator;

/**
 * What the host lends a renderer. It keeps all of it alive until meniscus_renderer_destroy has returned, and destroys it
 * itself.
 */
typedef struct {
    /**
     * sizeof(MeniscusHost).
     */
    size_t struct_size;
    /**
     * vkGetInstanceProcAddr: of the loader, or of whatever the host calls Vulkan through.
     */
    PFN_vkGetInstanceProcAddr get_instance_proc_addr;
    /**
     * Instance, created for Vulkan 1.3 (VkApplicationInfo::apiVersion).
     */
    VkInstance instance;
    /**
     * A physical device of the instance.
     */
    VkPhysicalDevice physical_device;
    /**
     * Its device, created with what meniscus_required_features turns on.
     */
    VkDevice device;
    /**
     * Family of the queue that the command buffers go to: graphics and compute.
     */
    uint32_t queue_family;
    /**
     * How many recorded frames may be waiting to complete: frames in flight, times views a frame; 1 to 256. 0 stands for 1.
     */
    uint32_t frames_in_flight;
    /**
     * A cache for the renderer's pipelines, or VK_NULL_HANDLE.
     */
    VkPipelineCache pipeline_cache;
    /**
     * VK_TRUE if the device was created with the feature largePoints. Without it everything is drawn as quads.
     */
    VkBool32 large_points;
    /**
     * VK_TRUE if the instance has VK_EXT_debug_utils enabled: then resources get names and passes labels.
     */
    VkBool32 debug_utils;
    /**
     * Where device memory comes from, read before the call returns; or null for an allocator of the renderer's own.
     */
    const MeniscusAllocator *allocator;
} MeniscusHost;

/**
 * A particle as it is drawn.
 */
typedef struct {
    /**
     * Centre.
     */
    float center[3];
    /**
     * The three semi-axis vectors, one after the other.
     */
    float axes[9];
} MeniscusEllipsoid;

/**
 * A particle as a density field takes it.
 */
typedef struct {
    /**
     * Where it is.
     */
    float position[3];
    /**
     * Its number density, as a part of a filled body's; above 0.
     */
    float density;
    /**
     * MENISCUS_CLASS_...
     */
    uint32_t kind;
} MeniscusPoint;

/**
 * GPU time of one pass.
 */
typedef struct {
    /**
     * The pass's name, also its debug label; ends with a 0.
     */
    char name[64];
    /**
     * What part of the frame it is: "particles", "visibility", or the family whose member it belongs to; ends with a 0.
     */
    char part[32];
    /**
     * Milliseconds from the pass's first to its last command.
     */
    double ms;
    /**
     * VK_TRUE if it works for the particles, whatever the view.
     */
    VkBool32 prepares;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusPassTime;

/**
 * One resource in device memory.
 */
typedef struct {
    /**
     * Resource name; ends with a 0.
     */
    char name[64];
    /**
     * Device memory in bytes, as the driver requires it.
     */
    uint64_t bytes;
    /**
     * VK_TRUE if it grows with the number of particles.
     */
    VkBool32 per_particle;
    /**
     * 0.
     */
    uint32_t reserved;
} MeniscusMemory;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Makes a chooser of `count` methods, those of these settings, the best first, each with a name of its own for messages; and of the
 * milliseconds that a frame may take on the device.
 *
 * # Safety
 * `names` and `methods` are null or `count` pointers, each null or to text and settings; `chooser` is null or can be written.
 */
MeniscusStatus meniscus_auto_create(double budget_ms,
                                    const char *const *names,
                                    const MeniscusSettings *const *methods,
                                    size_t count,
                                    MeniscusAuto **chooser);

/**
 * Destroys a chooser; null is none.
 *
 * # Safety
 * `chooser` is null, or a chooser that nobody uses any more.
 */
MeniscusStatus meniscus_auto_destroy(MeniscusAuto *chooser);

/**
 * Compiles what frames like this one need with any of the methods: then no change of method compiles anything. `made`, if it is not
 * null, tells how many pipelines were made.
 *
 * # Safety
 * `chooser` is null or a chooser, `renderer` null or a renderer; `frame` as in meniscus_renderer_warm_up_like; `made` is null or can
 * be written.
 */
MeniscusStatus meniscus_auto_warm_up(MeniscusAuto *chooser,
                                     MeniscusRenderer *renderer,
                                     const MeniscusFrame *frame,
                                     size_t *made);

/**
 * Tells which method the next frame is to be drawn with: `pick` its number, to be handed back with what that frame took; and puts it
 * into settings, if they are not null. Liquid, drawing and preparation stay.
 *
 * # Safety
 * `chooser` is null or a chooser; `pick` is null or can be written; `settings` is null or settings.
 */
MeniscusStatus meniscus_auto_pick(MeniscusAuto *chooser,
                                  size_t *pick,
                                  MeniscusSettings *settings);

/**
 * Takes note of what the frame last recorded into a slot took, which was drawn with this pick and has completed.
 * MENISCUS_STATUS_NOT_READY where the slot has no times yet. `changed`, if it is not null, tells whether another method follows from
 * it; the text is why the present one was chosen, as in meniscus_last_message, and `length` may be null.
 *
 * # Safety
 * `chooser` is null or a chooser, `renderer` null or a renderer; there is room for `capacity` bytes; `changed` and `length` are null
 * or can be written.
 */
MeniscusStatus meniscus_auto_observe(MeniscusAuto *chooser,
                                     MeniscusRenderer *renderer,
                                     uint32_t slot,
                                     size_t pick,
                                     VkBool32 *changed,
                                     char *text,
                                     size_t capacity,
                                     size_t *length);

/**
 * Fills a camera, whose struct_size is set, at `eye` that looks at `target`, `fov_y` radians high. Its projection is infinite: the
 * depth is 0 at `near_distance` and 1 infinitely far away, where a depth buffer is cleared to.
 *
 * # Safety
 * `eye`, `target` and `up` are three floats each; `camera` is null or a MeniscusCamera with its size.
 */
MeniscusStatus meniscus_camera_look_at(MeniscusCamera *camera,
                                       const float *eye,
                                       const float *target,
                                       const float *up,
                                       float fov_y,
                                       float aspect,
                                       float near_distance);

/**
 * Checks that a physical device can render at all; the message says what it lacks. What has to be enabled on the device besides
 * says meniscus_required_features.
 *
 * # Safety
 * `instance` is alive, and `get_instance_proc_addr` its vkGetInstanceProcAddr.
 */
MeniscusStatus meniscus_check_device(PFN_vkGetInstanceProcAddr get_instance_proc_addr,
                                     VkInstance instance,
                                     VkPhysicalDevice physical_device,
                                     uint32_t queue_family);

/**
 * Turns on the features that a device has to be created with; the rest of the struct stays as it is, sType and pNext too.
 *
 * # Safety
 * `features` is null, or a VkPhysicalDeviceVulkan13Features.
 */
MeniscusStatus meniscus_required_features(VkPhysicalDeviceVulkan13Features *features);

/**
 * Tells name number `index` of a list (MENISCUS_LIST_...). MENISCUS_STATUS_NOT_READY behind the last. Text as in
 * meniscus_last_message; `length` may be null.
 *
 * # Safety
 * There is room for `capacity` bytes; `length` is null or can be written.
 */
MeniscusStatus meniscus_list(uint32_t list, size_t index, char *text, size_t capacity, size_t *length);

/**
 * Classifies particles and gives each its shape, by the preparation's settings (splash_threshold and so on): what a renderer takes
 * with meniscus_renderer_set_prepared. The order of the particles changes nothing. Runs on all cores, and may run on any thread.
 *
 * # Safety
 * `particles` is null or a MeniscusParticles with its size, whose arrays are null or hold what is said of them; `settings` is null
 * or settings; `prepared` is null or can be written.
 */
MeniscusStatus meniscus_prepare(const MeniscusParticles *particles,
                                const MeniscusSettings *settings,
                                MeniscusPrepared **prepared);

/**
 * Fills a report, whose struct_size is set, of how many particles went which way.
 *
 * # Safety
 * `prepared` is null or prepared particles; `report` is null or a MeniscusReport with its size.
 */
MeniscusStatus meniscus_prepared_report(const MeniscusPrepared *prepared, MeniscusReport *report);

/**
 * Destroys prepared particles; null is none.
 *
 * # Safety
 * `prepared` is null, or prepared particles that nobody uses any more.
 */
MeniscusStatus meniscus_prepared_destroy(MeniscusPrepared *prepared);

/**
 * Tells the class of each particle (MENISCUS_CLASS_..., one byte each, in their order), by the setting splash_threshold. Against
 * popping from frame to frame a particle of `last` class keeps it while its density lies between that threshold and `upper`: give
 * the result to meniscus_prepare, and `upper` as keep_class_below. `last` may be null, and then `upper` counts for nothing; it may
 * be `classes`.
 *
 * # Safety
 * `positions` is null or three floats for each of `count` particles; `settings` is null or settings; `last` is null or `count`
 * bytes; `classes` is null or has room for as many.
 */
MeniscusStatus meniscus_classify(const float *positions,
                                 size_t count,
                                 float radius,
                                 const MeniscusSettings *settings,
                                 const uint8_t *last,
                                 float upper,
                                 uint8_t *classes);

/**
 * Guesses the particle radius from the nearest neighbours' distances, good to about 7 % on simulated liquid; a radius from the
 * simulation is always better. MENISCUS_STATUS_ERROR_PARAMETER where fewer than two places are distinct.
 *
 * # Safety
 * `positions` is null or three floats for each of `count` particles; `radius` is null or can be written.
 */
MeniscusStatus meniscus_estimate_radius(const float *positions, size_t count, float *radius);

/**
 * Sorts particles, to be asked how dense the liquid is, for instance at the eye.
 *
 * # Safety
 * `positions` is null or three floats for each of `count` particles; `settings` is null or settings; `density` is null or can be
 * written.
 */
MeniscusStatus meniscus_density_create(const float *positions,
                                       size_t count,
                                       float radius,
                                       const MeniscusSettings *settings,
                                       MeniscusDensity **density);

/**
 * Tells the liquid's density at a point, as a part of a filled body's: about 1 inside the liquid at rest, a half on a flat surface.
 *
 * # Safety
 * `density` is null or a density; `point` is null or three floats; `value` is null or can be written.
 */
MeniscusStatus meniscus_density_at(const MeniscusDensity *density,
                                   const float *point,
                                   float *value);

/**
 * Destroys a density; null is none.
 *
 * # Safety
 * `density` is null, or a density that nobody uses any more.
 */
MeniscusStatus meniscus_density_destroy(MeniscusDensity *density);

/**
 * Records one frame into the host's command buffer. After an error the command buffer is not to be submitted.
 *
 * # Safety
 * * `renderer` is null or a renderer; `frame` is null or a frame with its size, and so is what it points to.
 * * `cmd` is recording, outside rendering, and goes to a queue of the host's family, after all frames recorded before it.
 * * The frame last recorded into its slot has completed on the device.
 * * The buffers of its positions are alive until the frame has completed, hold what is said of them, and their earlier writes are
 *   visible to reads in compute shaders. What is written there later waits for the frame's compute shaders.
 * * The buffers of moving particles are alive until the frame has completed, and their earlier writes are visible to reads in vertex
 *   shaders.
 * * The output, and what there is of the scene, of an environment of the host's and of MeniscusFrame::surface, are alive until the
 *   frame has completed and in the stated layouts; all but the environment have the view in them, whole, where it is said to begin.
 *   Their earlier writes are visible to sampling in fragment shaders, and those of the output and of the surface's images to the
 *   attachment stages.
 */
MeniscusStatus meniscus_renderer_record(MeniscusRenderer *renderer,
                                        VkCommandBuffer cmd,
                                        const MeniscusFrame *frame);

/**
 * Says that the frame last recorded into a slot will never run: its command buffer was reset, or is not submitted. To be called
 * before the next frame is recorded into any slot, for each such frame, in any order. Waits for nothing.
 *
 * # Safety
 * `renderer` is null or a renderer.
 */
MeniscusStatus meniscus_renderer_abandon(MeniscusRenderer *renderer, uint32_t slot);

/**
 * Compiles what a frame like this one needs and is not there yet, of the particles last given or of its positions. Of what it names
 * (outputs, buffers, images) nothing is touched: null handles will do. `made`, if it is not null, tells how many pipelines were made.
 *
 * # Safety
 * `renderer` is null or a renderer; `frame` is null or a frame with its size, and so is what it points to; `made` is null or can be
 * written.
 */
MeniscusStatus meniscus_renderer_warm_up_like(MeniscusRenderer *renderer,
                                              const MeniscusFrame *frame,
                                              size_t *made);

/**
 * Makes a renderer for outputs of one format: UNORM formats receive colour encoded as sRGB, float and _SRGB formats linear colour.
 * Without an allocator of the host's it has one of its own on the host's device.
 *
 * # Safety
 * * The handles in `host` are of each other, alive, and stay so until meniscus_renderer_destroy has returned; so is what its
 *   allocator's functions need.
 * * The device was created with what meniscus_required_features turns on, and with largePoints if `host` says so.
 * * `renderer` is null or can be written.
 */
MeniscusStatus meniscus_renderer_create(const MeniscusHost *host,
                                        VkFormat output,
                                        MeniscusRenderer **renderer);

/**
 * Destroys a renderer and everything it made; null is none.
 *
 * # Safety
 * `renderer` is null, or a renderer that nobody uses any more. No frame that it recorded is in flight.
 */
MeniscusStatus meniscus_renderer_destroy(MeniscusRenderer *renderer);

/**
 * Sets the size of outputs to come, in pixels. Allocates nothing: the next frame does.
 *
 * # Safety
 * `renderer` is null or a renderer.
 */
MeniscusStatus meniscus_renderer_resize(MeniscusRenderer *renderer, uint32_t width, uint32_t height);

/**
 * Gives the particles of the frames to come, as meniscus_prepare made them. They are copied; what was given before goes.
 *
 * # Safety
 * `renderer` is null or a renderer; `prepared` is null or prepared particles.
 */
MeniscusStatus meniscus_renderer_set_prepared(MeniscusRenderer *renderer, const MeniscusPrepared *prepared);

/**
 * Gives the particles of the frames to come, as they are drawn: `splash_count` splashes first, then the body's. They are copied;
 * what was given before goes, speeds and points too.
 *
 * # Safety
 * `renderer` is null or a renderer; `ellipsoids` is null or `count` of them.
 */
MeniscusStatus meniscus_renderer_set_ellipsoids(MeniscusRenderer *renderer,
                                                float radius,
                                                const MeniscusEllipsoid *ellipsoids,
                                                size_t count,
                                                size_t splash_count);

/**
 * Says how fast the particles of meniscus_renderer_set_ellipsoids are, in world units a second and in their order; for spray.
 *
 * # Safety
 * `renderer` is null or a renderer; `speeds` is null or `count` floats.
 */
MeniscusStatus meniscus_renderer_set_speeds(MeniscusRenderer *renderer, const float *speeds, size_t count);

/**
 * Says where the particles of meniscus_renderer_set_ellipsoids are and how dense, for a density field; in any order.
 *
 * # Safety
 * `renderer` is null or a renderer; `points` is null or `count` of them.
 */
MeniscusStatus meniscus_renderer_set_points(MeniscusRenderer *renderer, const MeniscusPoint *points, size_t count);

/**
 * Gives the environment of the frames to come; records its upload. Linear RGB, row by row: the first row is straight up, columns run
 * once around, the first at atan2(z, x) = -pi. Values are finite and at least 0. It is copied.
 *
 * # Safety
 * `renderer` is null or a renderer; `rgb` is null or three floats for each of `width` x `height` texels. `cmd` is recording, outside
 * rendering, and is submitted before the frames that see the map.
 */
MeniscusStatus meniscus_renderer_set_environment(MeniscusRenderer *renderer,
                                                 VkCommandBuffer cmd,
                                                 uint32_t width,
                                                 uint32_t height,
                                                 const float *rgb);

/**
 * The same of a sky that needs no file: a clear afternoon over a tiled floor.
 *
 * # Safety
 * `renderer` is null or a renderer. `cmd` is recording, outside rendering, and is submitted before the frames that see the sky.
 */
MeniscusStatus meniscus_renderer_set_procedural_sky(MeniscusRenderer *renderer, VkCommandBuffer cmd);

/**
 * Compiles, on all cores, whatever frames with these settings can need, so that recording them compiles nothing. To be called after
 * meniscus_renderer_resize, when there is time. Not what MeniscusFrame::surface asks for, whose formats are not known here: that is
 * meniscus_renderer_warm_up_like's. `made`, if it is not null, tells how many pipelines were made.
 *
 * # Safety
 * `renderer` is null or a renderer; `settings` is null or settings; `made` is null or can be written.
 */
MeniscusStatus meniscus_renderer_warm_up(MeniscusRenderer *renderer,
                                         const MeniscusSettings *settings,
                                         size_t *made);

/**
 * Tells the GPU times of the frame last recorded into a slot, which has completed; does not wait. MENISCUS_STATUS_NOT_READY before
 * the first, or where the queue has no timestamps.
 *
 * Arrays are filled as this one everywhere: `*count` says how many elements of `element_size` (sizeof(MeniscusPassTime)) there is
 * room for, and is told how many there are, which may be more. With `passes` null only the number is told.
 *
 * # Safety
 * `renderer` is null or a renderer; `span_ms` is null or can be written; `passes` is null or has room for `*count` elements; `count`
 * is null or can be read and written.
 */
MeniscusStatus meniscus_renderer_times(MeniscusRenderer *renderer,
                                       uint32_t slot,
                                       double *span_ms,
                                       MeniscusPassTime *passes,
                                       size_t element_size,
                                       size_t *count);

/**
 * Tells the device memory that frames of a size take, resource by resource, before anything is allocated: of `splash` and `body`
 * particles prepared on the host, or of positions on the device, if they are not null (their buffers may be). Particles that the
 * host prepared are extra, 36 bytes each, 4 more with their speeds and 16 with their points, and an environment that the renderer
 * was given, 16 bytes a texel. Arrays as in meniscus_renderer_times.
 *
 * # Safety
 * `renderer` is null or a renderer; `settings` is null or settings; `positions` is null or positions with their size; `entries` is
 * null or has room for `*count` elements; `count` is null or can be read and written.
 */
MeniscusStatus meniscus_renderer_memory_requirements(MeniscusRenderer *renderer,
                                                     uint32_t width,
                                                     uint32_t height,
                                                     const MeniscusSettings *settings,
                                                     uint32_t splash,
                                                     uint32_t body,
                                                     const MeniscusPositions *positions,
                                                     MeniscusMemory *entries,
                                                     size_t element_size,
                                                     size_t *count);

/**
 * Tells the device memory that is in use now, resource by resource. Arrays as in meniscus_renderer_times.
 *
 * # Safety
 * `renderer` is null or a renderer; `entries` is null or has room for `*count` elements; `count` is null or can be read and written.
 */
MeniscusStatus meniscus_renderer_memory(MeniscusRenderer *renderer,
                                        MeniscusMemory *entries,
                                        size_t element_size,
                                        size_t *count);

/**
 * Tells the barriers of the frame last recorded, in order, one a line. Text as in meniscus_last_message; `length` may be null.
 *
 * # Safety
 * `renderer` is null or a renderer; there is room for `capacity` bytes; `length` is null or can be written.
 */
MeniscusStatus meniscus_renderer_plan(MeniscusRenderer *renderer, char *text, size_t capacity, size_t *length);

/**
 * Makes settings, all of them the defaults.
 *
 * # Safety
 * `settings` is null or can be written.
 */
MeniscusStatus meniscus_settings_create(MeniscusSettings **settings);

/**
 * Makes settings that are the same as others.
 *
 * # Safety
 * `of` is null or settings; `settings` is null or can be written.
 */
MeniscusStatus meniscus_settings_copy(const MeniscusSettings *of, MeniscusSettings **settings);

/**
 * Destroys settings; null is none.
 *
 * # Safety
 * `settings` is null, or settings that nobody uses any more.
 */
MeniscusStatus meniscus_settings_destroy(MeniscusSettings *settings);

/**
 * Takes the method of this name (meniscus_list, MENISCUS_LIST_PRESETS): layers, smoothing and optics with their parameters. Liquid,
 * drawing and preparation stay.
 *
 * # Safety
 * `settings` is null or settings; `name` is null or text.
 */
MeniscusStatus meniscus_settings_preset(MeniscusSettings *settings,
                                        const char *name);

/**
 * Takes another member of a family ("layers", "smooth" or "optics"), with its default parameters; the one that is there already
 * stays as it is. Whether the three go together says meniscus_settings_validate.
 *
 * # Safety
 * `settings` is null or settings; `family` and `member` are null or text.
 */
MeniscusStatus meniscus_settings_choose(MeniscusSettings *settings, const char *family, const char *member);

/**
 * Tells which member of a family ("layers", "smooth" or "optics") the settings have. Text as in meniscus_last_message; `length` may
 * be null.
 *
 * # Safety
 * `settings` is null or settings; `family` is null or text; there is room for `capacity` bytes; `length` is null or can be written.
 */
MeniscusStatus meniscus_settings_member(const MeniscusSettings *settings,
                                        const char *family,
                                        char *text,
                                        size_t capacity,
                                        size_t *length);

/**
 * Sets a parameter by name, from text: of the chosen members, of the liquid ("ior" "1.4", "absorption" "0.9,0.3,0.1"), of the
 * drawing, or of the preparation ("splash_threshold"). Ranges are checked by meniscus_settings_validate, and with every frame.
 *
 * # Safety
 * `settings` is null or settings; `name` and `value` are null or text.
 */
MeniscusStatus meniscus_settings_set(MeniscusSettings *settings, const char *name, const char *value);

/**
 * Tells a parameter's value, by name. Text as in meniscus_last_message; `length` may be null.
 *
 * # Safety
 * `settings` is null or settings; `name` is null or text; there is room for `capacity` bytes; `length` is null or can be written.
 */
MeniscusStatus meniscus_settings_get(const MeniscusSettings *settings,
                                     const char *name,
                                     char *text,
                                     size_t capacity,
                                     size_t *length);

/**
 * How many parameters settings have: those of the chosen members, of liquid, drawing and preparation.
 *
 * # Safety
 * `settings` is null or settings; `count` is null or can be written.
 */
MeniscusStatus meniscus_settings_parameter_count(const MeniscusSettings *settings, size_t *count);

/**
 * Tells one thing (MENISCUS_PARAMETER_...) of the parameter number `index`. Text as in meniscus_last_message; `length` may be null.
 *
 * # Safety
 * `settings` is null or settings; there is room for `capacity` bytes; `length` is null or can be written.
 */
MeniscusStatus meniscus_settings_parameter(const MeniscusSettings *settings,
                                           size_t index,
                                           uint32_t what,
                                           char *text,
                                           size_t capacity,
                                           size_t *length);

/**
 * Makes settings those of a picture that is rendered at `times` its size, to be averaged: what is counted in pixels covers the same
 * part of it.
 *
 * # Safety
 * `settings` is null or settings.
 */
MeniscusStatus meniscus_settings_enlarge(MeniscusSettings *settings,
                                         uint32_t times);

/**
 * Checks every range, and that layers, smoothing and optics go together.
 *
 * # Safety
 * `settings` is null or settings.
 */
MeniscusStatus meniscus_settings_validate(const MeniscusSettings *settings);

/**
 * Copies the message of the last call on this thread that did not end with MENISCUS_STATUS_OK: what is wrong, and what to do.
 * Calls that succeed leave it. Each thread has its own.
 *
 * Writes at most `capacity` bytes, the last of them 0; cut where a character ends. Gives the whole message's length without
 * the 0: with `capacity` 0 nothing is written, and `text` may be null.
 *
 * # Safety
 * `text` is null, or there is room for `capacity` bytes.
 */
size_t meniscus_last_message(char *text, size_t capacity);

/**
 * What Vulkan said where the last message on this thread is one of MENISCUS_STATUS_ERROR_VULKAN; VK_SUCCESS with others.
 */
VkResult meniscus_last_vk_result(void);

/**
 * A status as it is called here, such as "MENISCUS_STATUS_ERROR_ORDER"; of a number that is none of them "unknown". Never null,
 * and never to be freed.
 */
const char *meniscus_status_name(int status);

/**
 * The interface's version that this library has: MENISCUS_ABI_VERSION when it was built.
 */
uint32_t meniscus_abi_version(void);

/**
 * The library's own version, such as "0.1.0". Never to be freed.
 */
const char *meniscus_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* MENISCUS_H */
