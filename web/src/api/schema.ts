// Generated from web/openapi.json by `npm run schema`. Do not edit.

export interface paths {
    "/api/v1/about": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * About
         * @description What this robot is.
         */
        get: operations["about"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/camera.jpg": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Camera
         * @description The latest picture, with what was seen in it.
         */
        get: operations["camera"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/landmarks/sheet.pdf": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Landmark Sheet
         * @description Landmarks to scale, with instructions: to print at 100 %, to cut out and to glue.
         */
        get: operations["landmark_sheet"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/mission/end": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * End Mission
         * @description Give the job up; what is left can be planned anew.
         */
        post: operations["end_mission"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/mission/pause": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Pause Mission
         * @description Stand still and keep the job.
         */
        post: operations["pause_mission"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/mission/resume": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Resume Mission
         * @description Go on where the job was paused.
         */
        post: operations["resume_mission"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/missions": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Start Mission
         * @description Start to drive a plan.
         */
        post: operations["start_mission"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/plans": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Add Plan
         * @description Compute a plan and keep it. It is given up when whoever asked for it leaves.
         */
        post: operations["add_plan"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/plans/{plan_id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Plan
         * @description A plan that was computed before.
         */
        get: operations["get_plan"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/robot": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Robot
         * @description The newest snapshot, the same document as on the stream.
         */
        get: operations["get_robot"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/robot/clear": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Clear
         * @description Release the emergency stop; nothing moves by itself afterwards.
         */
        post: operations["clear"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/robot/site": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        /**
         * Choose Site
         * @description Load a site; the robot fixes its pose anew.
         */
        put: operations["choose_site"];
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/robot/stop": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Stop
         * @description Emergency stop: wheels off at once, latched until it is cleared.
         */
        post: operations["stop"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/runs": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * List Runs
         * @description All runs, newest first.
         */
        get: operations["list_runs"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/runs/{run_id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Run
         * @description One run, its plan, and what it left uncovered.
         */
        get: operations["get_run"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/runs/{run_id}/log": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Log
         * @description The run's MCAP file.
         */
        get: operations["get_log"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/runs/{run_id}/track": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Track
         * @description The positions of a run, thinned to what a screen can show.
         */
        get: operations["get_track"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/simulation": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Simulation
         * @description What stands in the simulated world besides the site.
         */
        get: operations["get_simulation"];
        /**
         * Change Simulation
         * @description Put obstacles into the simulated world, instead of those that are there.
         */
        put: operations["change_simulation"];
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/simulation/place": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Place
         * @description Lift the simulated robot and put it down elsewhere, without telling it.
         */
        post: operations["place"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * List Sites
         * @description All sites, by name.
         */
        get: operations["list_sites"];
        put?: never;
        /**
         * Add Site
         * @description Keep a new drawing; it must be a usable site.
         */
        post: operations["add_site"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/{site_id}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Site
         * @description The newest version of a site.
         */
        get: operations["get_site"];
        /**
         * Change Site
         * @description Keep a new version; the older ones stay. The robot takes it over when nothing runs.
         */
        put: operations["change_site"];
        post?: never;
        /**
         * Delete Site
         * @description Take a site off the list; its runs keep what they drove by.
         */
        delete: operations["delete_site"];
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/{site_id}.geojson": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Geojson
         * @description The site as GeoJSON in local metres.
         */
        get: operations["get_geojson"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/{site_id}/precision": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Site Precision
         * @description The precision map of a kept site, with its own landmarks or with others.
         */
        post: operations["site_precision"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/{site_id}/versions": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * List Versions
         * @description All versions, oldest first.
         */
        get: operations["list_versions"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/{site_id}/versions/{version}": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        /**
         * Get Version
         * @description One version of a site.
         */
        get: operations["get_version"];
        put?: never;
        post?: never;
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/check": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Check Site
         * @description Look for what is wrong with a drawing, without keeping it.
         */
        post: operations["check_site"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
    "/api/v1/sites/precision": {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        get?: never;
        put?: never;
        /**
         * Drawn Precision
         * @description The precision map of a drawing, without keeping it.
         */
        post: operations["drawn_precision"];
        delete?: never;
        options?: never;
        head?: never;
        patch?: never;
        trace?: never;
    };
}
export type webhooks = Record<string, never>;
export interface components {
    schemas: {
        /** About */
        About: {
            /**
             * Board
             * @enum {string}
             */
            board: "simulated" | "host" | "serial";
            model: components["schemas"]["RobotModel"];
            /** Name */
            name: string;
            /** Simulated */
            simulated: boolean;
            /** Site Id */
            site_id: number | null;
            /** Version */
            version: string;
        };
        /** CameraModel */
        CameraModel: {
            /** Constant */
            constant: number;
            /** Forward */
            forward: number;
            /** Half View */
            half_view: number;
            /** Height */
            height: number;
            /** Mount Height */
            mount_height: number;
            /** Rate */
            rate: number;
            /** Width */
            width: number;
        };
        /** CommandModel */
        CommandModel: {
            /** Speed */
            speed: number;
            /** Steering */
            steering: number;
        };
        /** DetectionModel */
        DetectionModel: {
            /** Bearing */
            bearing: number;
            /** Bottom */
            bottom: number;
            /** Column */
            column: number;
            /** Id */
            id: number;
            /** Range */
            range: number;
            /** Top */
            top: number;
        };
        /** Disc */
        Disc: {
            /** Radius */
            radius: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** DiscRequest */
        DiscRequest: {
            /** Radius */
            radius: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /**
         * DrawnPrecisionRequest
         * @description For a drawing that is not kept.
         */
        DrawnPrecisionRequest: {
            /**
             * Detail
             * @default coarse
             * @enum {string}
             */
            detail: "coarse" | "fine";
            /** Resolution */
            resolution?: number | null;
            /** Site */
            site: components["schemas"]["SiteDocument"];
            /**
             * Suggest
             * @default 0
             */
            suggest: number;
        };
        /** EventModel */
        EventModel: {
            /** Code */
            code: string;
            /**
             * Level
             * @enum {string}
             */
            level: "info" | "warning" | "fault";
            /** Seq */
            seq: number;
            /** Stamp */
            stamp: number;
            /** Text */
            text: string;
        };
        /**
         * FeatureCollection
         * @description GeoJSON in local metres; the property ``role`` says what each feature is.
         */
        FeatureCollection: {
            /** Features */
            features: {
                [key: string]: unknown;
            }[];
            /**
             * Name
             * @default
             */
            name: string;
            /**
             * Type
             * @constant
             */
            type: "FeatureCollection";
        };
        /** LandmarkDocument */
        LandmarkDocument: {
            /**
             * Bits
             * @default 4
             */
            bits: number;
            /**
             * Diameter
             * @default 0.07
             */
            diameter: number;
            /** Id */
            id: number;
            /**
             * Segment
             * @default 0.05
             */
            segment: number;
            /**
             * Shape
             * @default cylinder
             * @enum {string}
             */
            shape: "cylinder" | "flat";
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** LinkModel */
        LinkModel: {
            /** Age */
            age: number | null;
            /** Crc Errors */
            crc_errors: number;
            /** Lost */
            lost: number;
            /** Round Trip */
            round_trip: number | null;
            /** Sent */
            sent: number;
            /**
             * State
             * @enum {string}
             */
            state: "closed" | "connecting" | "idle" | "armed" | "link_lost" | "estop";
        };
        /** LoopModel */
        LoopModel: {
            /** Busy */
            busy: number;
            /** Lateness P99 */
            lateness_p99: number;
            /** Rate */
            rate: number;
        };
        /** MeasuredModel */
        MeasuredModel: {
            /** Heading */
            heading: number;
            /** Stamp */
            stamp: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** MissionModel */
        MissionModel: {
            /** Coverage */
            coverage: number | null;
            /** Elapsed */
            elapsed: number;
            /** Eta */
            eta: number | null;
            /** Length */
            length: number;
            /** Missed Area */
            missed_area: number | null;
            /**
             * Mode
             * @enum {string}
             */
            mode: "scan" | "route";
            /** Pausing Reason */
            pausing_reason: string;
            /** Plan Id */
            plan_id: number;
            /** Progress */
            progress: number;
            /** Route */
            route: string | null;
            /** Run Id */
            run_id: number;
            /** Site Id */
            site_id: number;
            /** Swept Area */
            swept_area: number | null;
            /** Travelled */
            travelled: number;
        };
        /** MissionRequest */
        MissionRequest: {
            /** Plan Id */
            plan_id: number;
        };
        /** PanModel */
        PanModel: {
            /** Maximum */
            maximum: number;
            /** Minimum */
            minimum: number;
            /** Rate */
            rate: number;
        };
        /** PlaceRequest */
        PlaceRequest: {
            /**
             * Heading
             * @default 0
             */
            heading: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** PlanPart */
        PlanPart: {
            /** First */
            first: number;
            /**
             * Kind
             * @enum {string}
             */
            kind: "loop" | "bridge" | "link" | "cleanup" | "route";
            /** Last */
            last: number;
        };
        /** PlanRecord */
        PlanRecord: {
            /** Area */
            area: [
                number,
                number
            ][][][];
            /** Clearance */
            clearance: number;
            /** Created At */
            created_at: number;
            /** Gear */
            gear: (1 | -1)[];
            /** Id */
            id: number;
            /** Min Turn Radius */
            min_turn_radius: number;
            /**
             * Mode
             * @enum {string}
             */
            mode: "scan" | "route";
            /** Nodes */
            nodes: [
                number,
                number
            ][];
            /** Notes */
            notes: string[];
            /** Parts */
            parts: components["schemas"]["PlanPart"][];
            /** Path */
            path: [
                number,
                number
            ][];
            /** Pending Of */
            pending_of: number | null;
            predicted: components["schemas"]["Prediction"];
            /** Route */
            route: string | null;
            /** Runtime */
            runtime: number;
            /** Site Id */
            site_id: number;
            /** Site Version */
            site_version: number;
            /** Tool Width */
            tool_width: number;
            /** Unreachable */
            unreachable: components["schemas"]["Unreachable"][];
        };
        /**
         * PlanRequest
         * @description What is not given comes from the vehicle's settings.
         */
        PlanRequest: {
            /** Clearance */
            clearance?: number | null;
            /** End Heading */
            end_heading?: number | null;
            /** Min Turn Radius */
            min_turn_radius?: number | null;
            /**
             * Mode
             * @enum {string}
             */
            mode: "scan" | "route";
            /** Order */
            order?: ("default" | "paper") | null;
            /** Pending Of */
            pending_of?: number | null;
            /** Route */
            route?: string | null;
            /** Site Id */
            site_id: number;
            /** Start */
            start?: [
                number,
                number
            ] | [
                number,
                number,
                number
            ] | null;
            /** Tool Width */
            tool_width?: number | null;
        };
        /** PoseModel */
        PoseModel: {
            /** Covariance */
            covariance: [
                number,
                number,
                number,
                number,
                number,
                number
            ];
            /** Heading */
            heading: number;
            /** Heading Sigma */
            heading_sigma: number;
            /** Position Sigma */
            position_sigma: number;
            /** Reason */
            reason: string;
            /** Stamp */
            stamp: number;
            /**
             * Status
             * @enum {string}
             */
            status: "fixing" | "tracking" | "degraded" | "lost";
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /**
         * PrecisionRecord
         * @description How well a standing robot will know its pose: a grid of square cells over the floor.
         */
        PrecisionRecord: {
            /** Classes */
            classes: number[];
            /** Columns */
            columns: number;
            /** Coverage */
            coverage: number;
            /** Heading */
            heading: (number | null)[][];
            /** Limit */
            limit: number;
            /** Mean Heading */
            mean_heading: number | null;
            /** Mean Position */
            mean_position: number | null;
            /** Overall */
            overall: number;
            /** Position */
            position: (number | null)[][];
            /** Reason */
            reason: number[][];
            /** Resolution */
            resolution: number;
            /** Rows */
            rows: number;
            /** Seen */
            seen: (number | null)[][];
            /** Share */
            share: (number | null)[][];
            suggest?: components["schemas"]["SuggestionsModel"] | null;
            /** Worst Position */
            worst_position: number | null;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /**
         * PrecisionRequest
         * @description For a kept site.
         */
        PrecisionRequest: {
            /**
             * Detail
             * @default coarse
             * @enum {string}
             */
            detail: "coarse" | "fine";
            /** Landmarks */
            landmarks?: components["schemas"]["LandmarkDocument"][] | null;
            /** Resolution */
            resolution?: number | null;
            /**
             * Suggest
             * @default 0
             */
            suggest: number;
        };
        /** PrecisionSummary */
        PrecisionSummary: {
            /** Coverage */
            coverage: number;
            /** Limit */
            limit: number;
            /** Mean Heading */
            mean_heading: number | null;
            /** Mean Position */
            mean_position: number | null;
            /** Overall */
            overall: number;
            /** Worst Position */
            worst_position: number | null;
        };
        /** Prediction */
        Prediction: {
            /** Coverage */
            coverage: number;
            /** Duration */
            duration: number;
            /** Length */
            length: number;
            /**
             * Overlap
             * @default 0
             */
            overlap: number;
            /** Reversals */
            reversals: number;
        };
        /**
         * Problem
         * @description RFC 9457. ``code`` is stable and for programs, ``remedy`` says what to do next.
         */
        Problem: {
            /** Code */
            code: string;
            /** Detail */
            detail: string;
            /**
             * Remedy
             * @default
             */
            remedy: string;
            /** Status */
            status: number;
            /** Title */
            title: string;
            /** Type */
            type: string;
            /**
             * Where
             * @default null
             */
            where: [
                number,
                number
            ] | null;
        };
        /** ProximityModel */
        ProximityModel: {
            /** Angles */
            angles: [
                number,
                number,
                number
            ];
            /** Forward */
            forward: number;
            /** Hard Limit */
            hard_limit: number;
            /** Max Range */
            max_range: number;
        };
        /** RealModel */
        RealModel: {
            /** Heading */
            heading: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** RobotModel */
        RobotModel: {
            camera: components["schemas"]["CameraModel"];
            pan: components["schemas"]["PanModel"];
            proximity: components["schemas"]["ProximityModel"];
            vehicle: components["schemas"]["VehicleModel"];
        };
        /** RouteDocument */
        RouteDocument: {
            /** Heading */
            heading?: number | null;
            /** Name */
            name: string;
            /** Nodes */
            nodes: [
                number,
                number
            ][];
        };
        /** RunDetail */
        RunDetail: {
            /** Coverage */
            coverage: number | null;
            /** Duration */
            duration: number;
            /** Ended At */
            ended_at: number | null;
            /** Id */
            id: number;
            /** Missed */
            missed: [
                number,
                number
            ][][][];
            /**
             * Mode
             * @enum {string}
             */
            mode: "scan" | "route";
            /** Outcome */
            outcome: string | null;
            plan: components["schemas"]["PlanRecord"];
            /** Plan Id */
            plan_id: number;
            /** Reason */
            reason: string;
            /** Route */
            route: string | null;
            /** Site Id */
            site_id: number;
            /** Site Version */
            site_version: number;
            /** Started At */
            started_at: number;
            /** Travelled */
            travelled: number;
        };
        /** RunRecord */
        RunRecord: {
            /** Coverage */
            coverage: number | null;
            /** Duration */
            duration: number;
            /** Ended At */
            ended_at: number | null;
            /** Id */
            id: number;
            /**
             * Mode
             * @enum {string}
             */
            mode: "scan" | "route";
            /** Outcome */
            outcome: string | null;
            /** Plan Id */
            plan_id: number;
            /** Reason */
            reason: string;
            /** Route */
            route: string | null;
            /** Site Id */
            site_id: number;
            /** Started At */
            started_at: number;
            /** Travelled */
            travelled: number;
        };
        /** Simulation */
        Simulation: {
            /** Obstacles */
            obstacles: components["schemas"]["Disc"][];
        };
        /** SimulationRequest */
        SimulationRequest: {
            /** Obstacles */
            obstacles: components["schemas"]["DiscRequest"][];
        };
        /** SiteCheck */
        SiteCheck: {
            /** Ok */
            ok: boolean;
            /** Problems */
            problems: components["schemas"]["SiteProblem"][];
            /** Repairs */
            repairs: string[];
        };
        /** SiteChoice */
        SiteChoice: {
            /** Site Id */
            site_id: number;
        };
        /**
         * SiteDocument
         * @description SITE.json. Only ``boundary`` is required; rings do not repeat their first point.
         */
        SiteDocument: {
            /** Boundary */
            boundary: [
                number,
                number
            ][];
            /**
             * Islands
             * @default []
             */
            islands: [
                number,
                number
            ][][];
            /**
             * Landmarks
             * @default []
             */
            landmarks: components["schemas"]["LandmarkDocument"][];
            /**
             * Name
             * @default
             */
            name: string;
            /**
             * No Go
             * @default []
             */
            no_go: [
                number,
                number
            ][][];
            /**
             * Routes
             * @default []
             */
            routes: components["schemas"]["RouteDocument"][];
            /** Start */
            start?: [
                number,
                number
            ] | [
                number,
                number,
                number
            ] | null;
            /**
             * Walls
             * @default []
             */
            walls: [
                number,
                number
            ][][];
        };
        /** SiteProblem */
        SiteProblem: {
            /** Code */
            code: string;
            /** Message */
            message: string;
            /** Where */
            where: [
                number,
                number
            ] | null;
        };
        /** SiteRecord */
        SiteRecord: {
            /** Id */
            id: number;
            /** Name */
            name: string;
            /** Repairs */
            repairs: string[];
            site: components["schemas"]["SiteDocument"];
            /** Updated At */
            updated_at: number;
            /** Version */
            version: number;
        };
        /** SiteSummary */
        SiteSummary: {
            /** Id */
            id: number;
            /** Name */
            name: string;
            /** Updated At */
            updated_at: number;
            /** Version */
            version: number;
        };
        /** SiteVersion */
        SiteVersion: {
            /** Updated At */
            updated_at: number;
            /** Version */
            version: number;
        };
        /**
         * Snapshot
         * @description One message of the stream.
         */
        Snapshot: {
            /** Battery */
            battery: number | null;
            command: components["schemas"]["CommandModel"];
            /** Detections */
            detections: components["schemas"]["DetectionModel"][];
            /** Detections Stamp */
            detections_stamp: number | null;
            /** Events */
            events: components["schemas"]["EventModel"][];
            link: components["schemas"]["LinkModel"];
            loop: components["schemas"]["LoopModel"];
            measured: components["schemas"]["MeasuredModel"] | null;
            mission: components["schemas"]["MissionModel"] | null;
            /** Obstacles */
            obstacles: components["schemas"]["Disc"][];
            /** Pan */
            pan: number | null;
            pose: components["schemas"]["PoseModel"] | null;
            /** Proximity */
            proximity: [
                number | null,
                number | null,
                number | null
            ];
            real: components["schemas"]["RealModel"] | null;
            /** Reason */
            reason: string;
            /** Seq */
            seq: number;
            /** Site Id */
            site_id: number | null;
            /** Stamp */
            stamp: number;
            /**
             * State
             * @enum {string}
             */
            state: "idle" | "fixing" | "ready" | "running" | "paused" | "stopped" | "lost";
            /** Target */
            target: [
                number,
                number
            ] | null;
            /**
             * Type
             * @constant
             */
            type: "snapshot";
            /** Wall */
            wall: number;
        };
        /** SuggestionModel */
        SuggestionModel: {
            /** Coverage */
            coverage: number;
            /** Id */
            id: number;
            /** Mean Position */
            mean_position: number | null;
            /** Overall */
            overall: number;
            /** X */
            x: number;
            /** Y */
            y: number;
        };
        /** SuggestionsModel */
        SuggestionsModel: {
            before: components["schemas"]["PrecisionSummary"];
            /** Gain */
            gain: number;
            /** Gain Bound */
            gain_bound: number;
            /** Overall Bound */
            overall_bound: number;
            /** Places */
            places: number;
            /** Suggestions */
            suggestions: components["schemas"]["SuggestionModel"][];
        };
        /**
         * Track
         * @description A run's positions, thinned to at most 5,000 moments; lists of equal length share ``t``.
         */
        Track: {
            /** Estimated */
            estimated: ([
                number,
                number,
                number,
                number
            ] | null)[];
            /** Events */
            events: components["schemas"]["TrackEvent"][];
            /** Measured */
            measured: [
                number,
                number,
                number
            ][];
            /** Real */
            real: ([
                number,
                number,
                number
            ] | null)[];
            /** T */
            t: number[];
            /** Target */
            target: ([
                number,
                number
            ] | null)[];
        };
        /** TrackEvent */
        TrackEvent: {
            /** Code */
            code: string;
            /**
             * Level
             * @enum {string}
             */
            level: "info" | "warning" | "fault";
            /** T */
            t: number;
            /** Text */
            text: string;
        };
        /** Unreachable */
        Unreachable: {
            /** Polygon */
            polygon: [
                number,
                number
            ][];
            /** Reason */
            reason: string;
        };
        /** VehicleModel */
        VehicleModel: {
            /** Body Radius */
            body_radius: number;
            /** Clearance */
            clearance: number;
            /** Max Acceleration */
            max_acceleration: number;
            /** Max Speed */
            max_speed: number;
            /** Max Steering */
            max_steering: number;
            /** Min Turn Radius */
            min_turn_radius: number;
            /** Plan Turn Radius */
            plan_turn_radius: number;
            /** Tool Width */
            tool_width: number;
            /** Track */
            track: number;
            /** Wheelbase */
            wheelbase: number;
        };
    };
    responses: never;
    parameters: never;
    requestBodies: never;
    headers: never;
    pathItems: never;
}
export type $defs = Record<string, never>;
export interface operations {
    about: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["About"];
                };
            };
        };
    };
    camera: {
        parameters: {
            query?: {
                /** @description Without the detections drawn. */
                plain?: boolean;
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "image/jpeg": string;
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    landmark_sheet: {
        parameters: {
            query: {
                /** @description Bits per landmark: 4, 5, 6 or 8. */
                bits?: number;
                /** @description Thickness or width, metres. */
                diameter?: number;
                /** @description As 1-15 or 1,3,7-9. */
                ids: string;
                /** @description A4, Letter, 420x594 (mm), roll-610 (mm), ... */
                paper?: string;
                /** @description Length of a segment, metres. */
                segment?: number;
                /** @description A tube, or a flat sticker. */
                shape?: "cylinder" | "flat";
            };
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/pdf": string;
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    end_mission: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    pause_mission: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    resume_mission: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    start_mission: {
        parameters: {
            query?: never;
            header?: {
                /** @description A repeated request with the same key is done once and answered alike. */
                "idempotency-key"?: string | null;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["MissionRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            201: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["RunRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    add_plan: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PlanRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            201: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["PlanRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_plan: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                plan_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["PlanRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_robot: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    clear: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    choose_site: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SiteChoice"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    stop: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    list_runs: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["RunRecord"][];
                };
            };
        };
    };
    get_run: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                run_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["RunDetail"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_log: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                run_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/octet-stream": unknown;
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_track: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                run_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Track"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_simulation: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Simulation"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    change_simulation: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SimulationRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Simulation"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    place: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PlaceRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["Snapshot"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    list_sites: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteSummary"][];
                };
            };
        };
    };
    add_site: {
        parameters: {
            query?: never;
            header?: {
                /** @description A repeated request with the same key is done once and answered alike. */
                "idempotency-key"?: string | null;
            };
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SiteDocument"];
            };
        };
        responses: {
            /** @description Successful Response */
            201: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_site: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    change_site: {
        parameters: {
            query?: never;
            header?: {
                /** @description The ETag that was edited, such as `"v3"`. */
                "if-match"?: string | null;
            };
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SiteDocument"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Somebody else changed it meanwhile. */
            412: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description If-Match is missing. */
            428: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    delete_site: {
        parameters: {
            query?: never;
            header?: {
                /** @description The ETag that was edited, such as `"v3"`. */
                "if-match"?: string | null;
            };
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            204: {
                headers: {
                    [name: string]: unknown;
                };
                content?: never;
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Refused in the present state; `code` says why and `remedy` what to do. */
            409: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description Somebody else changed it meanwhile. */
            412: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description If-Match is missing. */
            428: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_geojson: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["FeatureCollection"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    site_precision: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["PrecisionRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["PrecisionRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    list_versions: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                site_id: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteVersion"][];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    get_version: {
        parameters: {
            query?: never;
            header?: never;
            path: {
                site_id: number;
                version: number;
            };
            cookie?: never;
        };
        requestBody?: never;
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description There is no such thing. */
            404: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    check_site: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["SiteDocument"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["SiteCheck"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
    drawn_precision: {
        parameters: {
            query?: never;
            header?: never;
            path?: never;
            cookie?: never;
        };
        requestBody: {
            content: {
                "application/json": components["schemas"]["DrawnPrecisionRequest"];
            };
        };
        responses: {
            /** @description Successful Response */
            200: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/json": components["schemas"]["PrecisionRecord"];
                };
            };
            /** @description A foreign Host or Origin. */
            403: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The body is too large. */
            413: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description What was sent is not what was expected; `detail` names it. */
            422: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
            /** @description The robot or a device does not answer. */
            503: {
                headers: {
                    [name: string]: unknown;
                };
                content: {
                    "application/problem+json": components["schemas"]["Problem"];
                };
            };
        };
    };
}
