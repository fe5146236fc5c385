// What the service answers, as far as the page reads it; the whole is in /openapi.json.

export interface Bounds {
  readonly west: number;
  readonly south: number;
  readonly east: number;
  readonly north: number;
}

export interface Dem {
  readonly id: string;
  readonly name: string;
  readonly rows: number;
  readonly cols: number;
  readonly cell_east_m: number;
  readonly cell_north_m: number;
  readonly bounds_of_posts_m: Bounds;
  readonly crs: string | null;
  readonly crs_name: string | null;
  readonly body: string | null;
  readonly vertical_datum: string | null;
  readonly heights_count_from: string | null;
  readonly lowest_m: number | null;
  readonly highest_m: number | null;
  readonly unknown_posts: number;
  readonly conversions: readonly string[];
  readonly warnings: readonly string[];
  readonly sha256: string;
  readonly crs_wkt?: string | null;
  readonly crs_proj?: string | null;
}

export interface LayerLink {
  readonly name: string;
  readonly href: string;
  readonly description: string;
}

export interface Job<R> {
  readonly id: string;
  readonly status: "queued" | "running" | "succeeded" | "failed" | "cancelled" | "interrupted";
  readonly progress: number | null;
  readonly problem: { readonly detail?: string } | null;
  readonly links: { readonly self: string };
  readonly result: R | null;
  readonly layers: readonly LayerLink[];
}

export interface Summary {
  readonly mode: string;
  readonly error_statement: string;
  readonly curvature: string;
  readonly warnings: readonly string[];
}

export interface Place {
  readonly east_m: number;
  readonly north_m: number;
}

export interface AnchorAnswer extends Place {
  readonly id: string;
  readonly altitude_m: number;
  readonly above_ground_m: number | null;
}

export interface Relaxation {
  readonly reason: string;
  readonly asked: number | null;
  readonly needed: number | null;
  readonly unit: string;
  readonly sentence: string;
  readonly shown: boolean;
}

export interface PathTotals {
  readonly length_m: number;
  readonly climb_m: number;
  readonly descent_m: number;
  readonly time_s: number;
  readonly out_of_sight_s: number;
  readonly longest_out_of_sight_s: number;
  readonly worst_dop: number | null;
  readonly fewest_anchors: number;
  readonly mean_position_sigma_m: number | null;
  readonly steepest_deg: number;
}

/** Another way beside a path. */
export interface PathWay {
  readonly what: "shortest" | "in sight" | "surest" | "another way";
  readonly sentence: string;
  readonly apart_share: number;
  readonly totals: PathTotals;
  readonly corners: readonly Place[];
}

/** A time to leave that was tried, on the clock of what flies. */
export interface Departure {
  readonly departure_s: number;
  /** null: there is no path then. */
  readonly arrival_s: number | null;
  readonly in_time: boolean;
  readonly taken: boolean;
  readonly sentence: string;
}

export interface PathAnswer extends Summary {
  readonly status: string;
  readonly sentence: string;
  readonly totals: PathTotals | null;
  readonly alternatives: readonly PathWay[];
  readonly alternatives_sentence: string;
  readonly departures: readonly Departure[];
  readonly departures_sentence: string;
  readonly unreachable: {
    readonly reason: string;
    readonly where: Place;
    readonly relaxations: readonly Relaxation[];
  } | null;
  readonly validation: { readonly passed: boolean; readonly sentence: string } | null;
}

export interface PlacedAnchor extends AnchorAnswer {
  readonly what: string;
  readonly marginal_share?: number;
  readonly marginal_m?: number;
}

export interface PlacementAnswer extends Summary {
  readonly goal: string;
  readonly placed: readonly PlacedAnchor[];
  readonly candidates: { readonly left: number; readonly removed: Readonly<Record<string, number>> };
  readonly method: string;
  readonly proved: boolean;
  readonly before_share?: number;
  readonly value_share?: number;
  readonly bound_share?: number;
  readonly before_m?: number;
  readonly value_m?: number;
  readonly bound_m?: number;
}

export interface RepositioningAnswer extends Summary {
  readonly restored: boolean;
  readonly moves: readonly { readonly anchor_id: string; readonly to: AnchorAnswer }[];
}

export interface MorphingAnswer extends Summary {
  readonly states: readonly { readonly state: string; readonly posts: number; readonly share: number | null }[];
  readonly above_ground_m: Readonly<Record<string, number | null>>;
}

export interface FlightAnswer extends Summary {
  readonly status: string;
  readonly sentence: string;
  readonly totals: {
    readonly length_m: number;
    readonly climb_m: number;
    readonly time_s: number;
    readonly highest_m: number;
    readonly clearance_m: number;
    /** Least height over the morphing map; null without one. */
    readonly margin_m: number | null;
  } | null;
  readonly corners: readonly (Place & { readonly altitude_m: number })[];
  readonly validation: { readonly passed: boolean; readonly sentence: string } | null;
}

export interface FrameFacts {
  readonly time_s: number;
  /** ISO 8601 where satellites give the time. */
  readonly time: string | null;
  readonly anchors: number;
  readonly satellites: number;
  readonly share_flyable: number | null;
}

export interface FramesAnswer extends MorphingAnswer {
  readonly over_time: {
    readonly frames: readonly FrameFacts[];
    readonly share_always_available: number | null;
    readonly share_never_available: number | null;
  };
}

/** A radio link from end to end; null where it is not known, or nothing arrives. */
export interface SignalAnswer {
  readonly diffraction_db: number | null;
  readonly canopy_m: number | null;
  readonly canopy_db: number | null;
  readonly margin_db: number | null;
  readonly probability: number | null;
}

export interface ProbeAnswer {
  readonly points: readonly {
    readonly anchors: readonly {
      readonly id: string;
      readonly verdict: "visible" | "hidden" | "unknown" | "out_of_reach";
      readonly clearance_m: number | null;
      readonly blocking_point: (Place & { readonly altitude_m: number }) | null;
      /** null without a radio. */
      readonly signal: SignalAnswer | null;
    }[];
    readonly dilution: Readonly<Record<"gdop" | "pdop" | "hdop" | "vdop", number | null>> | null;
    readonly position_sigma_m: number | null;
  }[];
}

export interface ProfileAnswer {
  readonly verdict: "clear" | "blocked" | "unknown";
  readonly clearance_m: number | null;
  readonly distance_m: readonly number[];
  readonly ground_m: readonly (number | null)[];
  /** null where nothing stands; all of it where no buildings were asked for. */
  readonly roof_m: readonly (number | null)[] | null;
  /** null beside trees; all of it where no trees were asked for. */
  readonly canopy_base_m: readonly (number | null)[] | null;
  readonly canopy_top_m: readonly (number | null)[] | null;
  readonly line_m: readonly number[];
  readonly fresnel_radius_m: readonly number[] | null;
  readonly fresnel_clearance: number | null;
  readonly blocking_point: { readonly altitude_m: number } | null;
  readonly blocking_distance_m: number | null;
  readonly signal: SignalAnswer | null;
}
